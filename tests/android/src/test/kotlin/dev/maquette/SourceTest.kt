package dev.maquette

import java.lang.ref.WeakReference
import java.util.concurrent.CountDownLatch
import kotlin.concurrent.thread
import org.junit.Assert.assertEquals
import org.junit.Assert.assertNotEquals
import org.junit.Assert.assertNull
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

class SourceTest : AndroidTest() {
    private val maquette = Maquette()

    @Test
    fun aStubDeliversItsFramesAndEnds() {
        maquette.source("stub:people?frames=5&size=64x48&fps=10&seed=3").use { source ->
            val info = source.info
            assertEquals(listOf<Any>(64, 48, 10.0, 5L), with(info) { listOf(widthPx, heightPx, fps, frameCount) })
            assertEquals(listOf<Any>(false, Clock.MEDIA, 4), with(info) { listOf(isLive, clock, framePoolSize) })
            val times = generateSequence { source.acquireFrame() }.map { it.use { frame -> frame.timestampNs } }
            assertEquals(List(5) { it * 100_000_000L }, times.toList())
            assertNull(source.acquireFrame())
            source.seek(250_000_000)
            assertEquals(3L, source.acquireFrame()!!.use(Frame::sequence))
        }
    }

    @Test
    fun aClipIsDecodedAndScaled() {
        val config = Source.Config(maxSidePx = 320)
        maquette.source("video:${TestFiles.clip.path}", config).use { source ->
            assertEquals(320 to 180, source.info.widthPx to source.info.heightPx)
            source.seek(2_000_000_000)
            source.acquireFrame()!!.use { frame ->
                assertEquals(listOf<Any>(320, 180, 60L), with(frame) { listOf(widthPx, heightPx, sequence) })
                val picture = frame.toBitmap()
                assertNotEquals(picture.getPixel(10, 10), picture.getPixel(200, 100))
            }
        }
    }

    @Test
    fun framesThatAreHeldAreAsManyAsThePoolHas() {
        maquette.source("stub:pattern?size=64x48", Source.Config(framePoolSize = 2)).use { source ->
            val held = List(2) { source.acquireFrame()!! }
            failure(Status.POOL_EMPTY) { source.acquireFrame() }
            held[0].close()
            source.acquireFrame()!!.close()
            held[1].close()
        }
    }

    @Test
    fun aLiveSourceIsWaitedForAndStopsAtOnce() {
        val config = Source.Config(isRealTime = true)
        maquette.source("stub:pattern?size=64x48&fps=0.01", config).use { source ->
            assertTrue(source.info.isLive)
            assertEquals(Clock.MONOTONIC, source.info.clock)
            source.acquireFrame()!!.close()
            failure(Status.TIMEOUT) { source.acquireFrame(timeoutMs = 20) }
            failure(Status.TIMEOUT) { source.acquireFrame(timeoutMs = 0) }
            for (end in listOf(Source::stop, Source::close)) {
                maquette.source("stub:pattern?size=64x48&fps=0.01", config).use { other ->
                    other.acquireFrame()!!.close()
                    val waits = CountDownLatch(1)
                    var frame: Frame? = null
                    val waiting = thread {
                        waits.countDown()
                        frame = runCatching { other.acquireFrame() }.getOrNull() // if it is closed before: an exception
                    }
                    waits.await()
                    Thread.sleep(50)
                    soon {
                        end(other)
                        waiting.join()
                    }
                    assertNull(frame)
                }
            }
        }
    }

    @Test
    fun wrongInputIsAnExceptionThatSaysWhatToDo() {
        failure(Status.INVALID_ARGUMENT) { maquette.source("") }
        failure(Status.INVALID_ARGUMENT) { maquette.source("stub:people?count=many") }
        failure(Status.INVALID_ARGUMENT) { maquette.source("stub:people\u0000?count=2") }
        failure(Status.UNSUPPORTED) { maquette.source("smoke:signals") }
        val missing = failure(Status.NOT_FOUND) { maquette.source("video:/no/clüb 🏃.mp4") }
        assertTrue(missing, "clüb 🏃" in missing)
        failure(Status.UNREADABLE) { maquette.source("rec:${TestFiles.photo.path}") }
        failure(Status.INVALID_ARGUMENT) { maquette.source("stub:pattern", Source.Config(framePoolSize = -1)) }
        failure(Status.INVALID_ARGUMENT) { maquette.source("stub:pattern", Source.Config(queueLength = 65)) }
        maquette.source("stub:pattern?size=64x48").use { source ->
            failure(Status.INVALID_ARGUMENT) { source.seek(-1) }
            assertNull(source.intrinsics)
            assertNull(source.control(Source.Control.EXPOSURE))
            failure(Status.UNSUPPORTED) { source.setControl(Source.Control.EXPOSURE, 1000.0) }
        }
        assertThrows(IllegalArgumentException::class.java) {
            Intrinsics(64, 48, 60.0, 60.0, 32.0, 24.0, distortion = listOf(0.1))
        }
    }

    @Test
    fun itIsClosedBeforeOrAfterItsFramesAndNotUsedAfterwards() {
        val ofIts = Maquette()
        val source = ofIts.source("stub:people?size=64x48")
        ofIts.close()
        val frame = source.acquireFrame()!!
        source.close()
        source.close()
        assertEquals(64, frame.widthPx)
        assertEquals(64, frame.toBitmap().width)
        frame.close()
        assertClosed { frame.toBitmap() }
        assertClosed { source.acquireFrame() }
        assertClosed { source.stop() }
        assertClosed { source.info }
        assertClosed { source.seek(0) }
        assertClosed { ofIts.source("stub:people") }
    }

    @Test
    fun kindsOfSourcesAndCamerasAreListed() {
        val stub = Source.schemes.single { it.name == "stub" }
        assertTrue(stub.example.startsWith("stub:") && stub.summary.isNotEmpty() && !stub.isCamera)
        assertTrue(Source.schemes.single { it.name == "v4l2" }.isCamera)
        for (camera in maquette.cameras()) assertTrue(camera.uri, ":" in camera.uri)
    }

    @Test
    fun tenThousandSourcesLeaveNothing() {
        fun open(count: Int, config: Source.Config) =
            repeat(count) { maquette.source("stub:pattern?size=32x24", config).close() }
        open(1000, Source.Config())
        val before = residentMiB()
        open(9_000, Source.Config())
        open(100, Source.Config(isRealTime = true))
        assertTrue("${residentMiB() - before} MiB more", residentMiB() - before < 40)
    }

    @Test
    fun nativeCodeForgetsWhomItToldOfChanges() {
        fun toldOf(uri: String) = WeakReference(maquette.source(uri).apply { close() }.stateChanges)
        val told = List(20) { toldOf("stub:pattern?size=32x24&live=1") }
        until("they are forgotten", meanwhile = System::gc) { told.all { it.get() == null } }
    }

    @Test
    fun framesThatAreForgottenComeBackToThePool() {
        maquette.source("stub:pattern?size=64x48", Source.Config(framePoolSize = 3)).use { source ->
            repeat(60) {
                until("a frame comes back", meanwhile = System::gc) {
                    try {
                        source.acquireFrame()!!.widthPx == 64
                    } catch (error: MaquetteException) {
                        assertEquals(Status.POOL_EMPTY, error.status)
                        false
                    }
                }
            }
        }
    }
}
