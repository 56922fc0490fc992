package dev.maquette

import dev.maquette.jni.Native
import java.util.concurrent.CountDownLatch
import kotlin.concurrent.thread
import kotlinx.coroutines.CompletableDeferred
import kotlinx.coroutines.Dispatchers
import kotlinx.coroutines.cancelAndJoin
import kotlinx.coroutines.flow.map
import kotlinx.coroutines.flow.take
import kotlinx.coroutines.flow.toList
import kotlinx.coroutines.launch
import kotlinx.coroutines.runBlocking
import org.junit.Assert.assertEquals
import org.junit.Assert.assertNotNull
import org.junit.Assert.assertNull
import org.junit.Assert.assertTrue
import org.junit.Test

class ConcealerTest : AndroidTest() {
    private val maquette = Maquette()
    private val config = Concealer.Config(threads = 1)

    private fun live(options: String) = maquette.source("stub:people?count=1&size=160x120&live=1&$options")

    /** A source whose second frame comes much later, if ever. */
    private fun stalled() = live("fps=0.01").apply { acquireFrame()!!.close() }

    @Test
    fun gapsAreBridgedByFramesThatSaySo() =
        live("fps=20&drop=0.3&frames=60&seed=5").use { source ->
            maquette.concealer(source, config).use { concealer ->
                failure(Status.BUSY) { source.acquireFrame(0) }
                failure(Status.BUSY) { maquette.concealer(source) }
                val frames = generateSequence { concealer.acquireFrame() }
                    .map { it.use { frame -> Triple(frame.timestampNs, frame.sequence, frame.origin) } }.toList()
                val times = frames.map { it.first }
                assertEquals(times.sorted().distinct(), times)
                val madeUp = frames.filter { it.third != null }
                val stats = concealer.stats
                assertEquals(with(stats) { capturedCount + predictedCount - droppedCount }, frames.size.toLong())
                assertTrue("${madeUp.size} of $stats", madeUp.size in 1..stats.predictedCount)
                for ((time, sequence, origin) in madeUp) {
                    assertTrue("$origin", origin!!.horizonNs in 1..300_000_000 && origin.ageNs >= origin.horizonNs)
                    assertEquals(sequence, origin.capturedSequence)
                    assertEquals(time, origin.capturedTimestampNs + origin.horizonNs)
                }
                assertTrue("$stats", with(stats) { maxWaitMs >= latestWaitMs && latestGapMs in 40.0..300.0 })
            }
        }

    @Test
    fun aGapIsBridgedAsFarAsIsAskedFor() =
        live("fps=20&stall=1s@0.6s&loop=1").use { source ->
            maquette.concealer(source, config.copy(maxGapMs = 120, method = Predictor.Method.LAST)).use { concealer ->
                val horizons = mutableListOf<Long>()
                until("the stall is over", meanwhile = {
                    concealer.acquireFrame()!!.use { frame -> frame.origin?.let { horizons.add(it.horizonNs) } }
                }) { concealer.stats.predictedCount >= 2 && concealer.stats.capturedCount > 14 }
                assertTrue("$horizons", horizons.isNotEmpty() && horizons.all { it in 1..120_000_000 })
            }
        }

    @Test
    fun timeoutsAreLimits() =
        stalled().use { source ->
            maquette.concealer(source, config).use { concealer ->
                for (timeoutMs in listOf(0L, 20L, 170L)) {
                    val begin = System.nanoTime()
                    val said = failure(Status.TIMEOUT) { concealer.acquireFrame(timeoutMs) }
                    assertTrue(said, " $timeoutMs ms" in said)
                    assertTrue(System.nanoTime() - begin >= timeoutMs * 1_000_000)
                }
                assertEquals(0L, concealer.stats.predictedCount)
            }
        }

    @Test
    fun stoppingAndClosingEndAWait() {
        for (end in listOf<(Source, Concealer) -> Unit>(
            { source, _ -> source.stop() },
            { source, _ -> source.close() },
            { _, concealer -> concealer.close() },
        )) {
            for (timeoutMs in listOf(WAIT_FOREVER, 3_600_000L, Long.MAX_VALUE)) {
                stalled().use { source ->
                    maquette.concealer(source, config).use { concealer ->
                        val waits = CountDownLatch(1)
                        var outcome: Result<Frame?>? = null
                        val waiting = thread {
                            waits.countDown()
                            outcome = runCatching { concealer.acquireFrame(timeoutMs) }
                        }
                        waits.await()
                        Thread.sleep(70)
                        soon {
                            end(source, concealer)
                            waiting.join()
                        }
                        val error = outcome!!.exceptionOrNull() // that it is closed, where it was before the call
                        assertTrue("$error", error == null || error is IllegalStateException)
                        assertNull(outcome!!.getOrNull())
                    }
                }
            }
        }
    }

    @Test
    fun theSourceHasItsFramesBackAfterwards() =
        live("fps=100").use { source ->
            repeat(3) {
                maquette.concealer(source, config).use { concealer -> concealer.acquireFrame()!!.close() }
                source.acquireFrame()!!.close()
            }
        }

    @Test
    fun theyAreClosedInAnyOrderAndNotUsedAfterwards() {
        val ofIts = Maquette()
        val source = ofIts.source("stub:pattern?size=64x48&live=1&fps=100")
        val concealer = ofIts.concealer(source, config.copy(framePoolSize = 1))
        ofIts.close()
        assertClosed { ofIts.concealer(source) }
        val frame = concealer.acquireFrame()!!
        failure(Status.POOL_EMPTY) { concealer.acquireFrame() }
        source.close()
        assertClosed { maquette.concealer(source) }
        frame.close()
        while (true) (concealer.acquireFrame() ?: break).close() // those that waited
        assertTrue(concealer.stats.capturedCount > 0)
        concealer.close()
        concealer.close()
        assertClosed { concealer.acquireFrame() }
        assertClosed { concealer.stats }

        val other = live("fps=100")
        val held = maquette.concealer(other, config).use { it.acquireFrame()!! }
        other.close()
        assertEquals(160 * 120, MovingTexture.greysOf(held).size)
        held.close()
    }

    @Test
    fun aSourceThatIsForgottenStaysOpenAsLongAsItsConcealer() {
        val concealer = maquette.concealer(maquette.source("stub:pattern?size=64x48&live=1&fps=100"), config)
        var frames = 0
        whileGarbageIsCollected("frames come") {
            val frame = concealer.acquireFrame()
            assertNotNull("after $frames frames", frame)
            frame!!.close()
            ++frames > 40
        }
        concealer.close()
    }

    @Test
    fun concealersThatAreForgottenEndTheirThreads() {
        live("fps=100").use { source ->
            val threads = threadCount()
            maquette.concealer(source, config).acquireFrame()!!.close()
            until("the source is free again", meanwhile = System::gc) {
                runCatching { source.acquireFrame(0)?.close() }.exceptionOrNull()
                    .let { it == null || (it as MaquetteException).status == Status.TIMEOUT }
            }
            until("its threads have ended", meanwhile = System::gc) { threadCount() <= threads }
        }
    }

    @Test
    fun aFlowHasTheFramesAndIsCancelled() = runBlocking<Unit> {
        live("fps=50&drop=0.2").use { source ->
            maquette.concealer(source, config).use { concealer ->
                val times = concealer.frames().map { it.use(Frame::timestampNs) }.take(10).toList()
                assertEquals(times.sorted().distinct(), times)
                source.stop()
                concealer.frames().collect(Frame::close) // it ends
            }
        }
        stalled().use { source ->
            maquette.concealer(source, config).use { concealer ->
                val begun = CompletableDeferred<Unit>()
                val collector = launch(Dispatchers.Default) {
                    begun.complete(Unit)
                    concealer.frames().collect(Frame::close)
                }
                begun.await()
                soon { runBlocking { collector.cancelAndJoin() } }
                failure(Status.TIMEOUT) { concealer.acquireFrame(0) }
            }
        }
    }

    @Test
    fun wrongInputIsAnExceptionThatSaysWhatToDo() {
        maquette.source("stub:people?size=64x48").use { source ->
            val said = failure(Status.UNSUPPORTED) { maquette.concealer(source) }
            assertTrue(said, "not live" in said)
            source.acquireFrame()!!.close() // and it was left as it was
        }
        live("fps=50").use { source ->
            val wrong = listOf(
                Concealer.Config(maxGapMs = -1) to "max_gap_ms",
                Concealer.Config(maxGapMs = 10_001) to "max_gap_ms",
                Concealer.Config(threads = 65) to "threads",
                Concealer.Config(framePoolSize = -1) to "frame_pool_size",
            )
            for ((wrongConfig, name) in wrong) {
                assertTrue(name in failure(Status.INVALID_ARGUMENT) { maquette.concealer(source, wrongConfig) })
            }
            maquette.concealer(source, config).close()
            source.handle.use { handle ->
                failure(Status.INVALID_ARGUMENT) { Native.maq_concealer_create(0, handle, config.native()) }
            }
        }
        live("fps=20&unplug@0.5s").use { source ->
            maquette.concealer(source, config).use { concealer ->
                until("frames come", meanwhile = { concealer.acquireFrame()!!.close() }) {
                    concealer.stats.predictedCount > 0
                }
            }
        }
    }
}
