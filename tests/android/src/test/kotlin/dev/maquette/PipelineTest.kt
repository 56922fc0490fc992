package dev.maquette

import java.io.File
import java.util.concurrent.CountDownLatch
import kotlin.concurrent.thread
import kotlinx.coroutines.CompletableDeferred
import kotlinx.coroutines.Dispatchers
import kotlinx.coroutines.async
import kotlinx.coroutines.cancelAndJoin
import kotlinx.coroutines.delay
import kotlinx.coroutines.flow.first
import kotlinx.coroutines.flow.map
import kotlinx.coroutines.flow.take
import kotlinx.coroutines.flow.toList
import kotlinx.coroutines.flow.transformWhile
import kotlinx.coroutines.launch
import kotlinx.coroutines.runBlocking
import kotlinx.coroutines.withTimeout
import org.junit.Assert.assertEquals
import org.junit.Assert.assertFalse
import org.junit.Assert.assertNull
import org.junit.Assert.assertTrue
import org.junit.Test

class PipelineTest : AndroidTest() {
    private val maquette = Maquette()
    private val bundle = ModelBundle.ofFolder(TestFiles.bundle.path)
    private val small = DensePose.Config(longSidePx = 128, threads = 1)
    private val stub = "stub:people?size=160x120&seed=1"
    private val photo = "image:${TestFiles.photo.path}"

    @Test
    fun aPhotoHasOneResultWhateverWayTheBundleComes() {
        for (networks in listOf(bundle, ModelBundle.ofBuffers(TestFiles.bundleInMemory()))) {
            maquette.pipeline(networks).use { pipeline ->
                assertEquals(Pipeline.Info(Pipeline.State.STOPPED, Status.OK, "", ""), pipeline.info)
                assertNull(pipeline.acquireResult())
                pipeline.setSource(photo)
                pipeline.acquireResult()!!.use { result ->
                    assertEquals(1, result.densePose.people.size)
                    assertEquals(512, result.frame.widthPx)
                    assertEquals(1L, result.number)
                    assertTrue(result.runMs > 0 && result.waitMs >= 0)
                    assertNull("a photo has no age", result.ageMs)
                }
                assertNull(pipeline.acquireResult())
                assertEquals(Pipeline.Info(Pipeline.State.ENDED, Status.OK, "", photo), pipeline.info)
                assertEquals(1L to 0L, pipeline.stats.results to pipeline.stats.droppedResults)
            }
        }
    }

    @Test
    fun resultsAreAFlowThatCanBeCancelledAndKeepsNone() = runBlocking<Unit> {
        val config = Pipeline.Config(resultPoolSize = 2, densePose = small)
        maquette.pipeline(bundle, config).use { pipeline ->
            pipeline.setSource(stub)
            val numbers = pipeline.results().map { it.use(PipelineResult::number) }.take(3).toList()
            assertEquals(numbers.sorted().distinct(), numbers)
            repeat(30) { round ->
                val collector = launch(Dispatchers.Default) { pipeline.results().collect(PipelineResult::close) }
                delay(round * 2L)
                collector.cancelAndJoin()
                List(2) { pipeline.acquireResult()!! }.forEach(PipelineResult::close)
            }
            val held = List(2) { pipeline.acquireResult()!! }
            failure(Status.POOL_EMPTY) { pipeline.acquireResult() }
            held.forEach(PipelineResult::close)
            val collector = launch(Dispatchers.Default) { pipeline.results().collect(PipelineResult::close) }
            delay(50)
            pipeline.stop()
            withTimeout(SOON_MS) { collector.join() }
        }
    }

    @Test
    fun aBudgetThatCannotBeKeptLowersWhatIsDone() {
        val config = Pipeline.Config(densePose = small.copy(longSidePx = 160), frameBudgetMs = 0.01)
        maquette.pipeline(bundle, config).use { pipeline ->
            pipeline.setSource(stub)
            until("the input is small", meanwhile = { pipeline.acquireResult()!!.close() }) {
                pipeline.stats.longSidePx in 1..96
            }
            assertEquals(4, pipeline.stats.keyFrameInterval)
        }
    }

    @Test
    fun aProviderThatIsNotThereIsDoneWithout() {
        for (provider in DensePose.Provider.entries) {
            maquette.densePose(bundle, small.copy(provider = provider)).use { densePose ->
                maquette.decode(TestFiles.photo.readBytes()).use { frame ->
                    densePose.run(frame).use { assertEquals(DensePose.Provider.CPU, it.stats.provider) }
                }
            }
        }
    }

    @Test
    fun threadsAreANumberOrMeasured() {
        for (threads in listOf(2, DensePose.THREADS_MEASURED)) {
            maquette.densePose(bundle, small.copy(threads = threads)).use { densePose ->
                val stats = maquette.decode(TestFiles.photo.readBytes()).use { frame ->
                    densePose.run(frame).use { it.stats }
                }
                assertEquals(threads == DensePose.THREADS_MEASURED, stats.isThreadsMeasured)
                assertTrue(stats.threads == 2 || stats.isThreadsMeasured && stats.threads in 1..4)
            }
        }
    }

    @Test
    fun changesComeInOrderUntilItIsClosed() = runBlocking<Unit> {
        val pipeline = maquette.pipeline(bundle, Pipeline.Config(densePose = small))
        val isListening = CompletableDeferred<Unit>()
        val untilTheEnd = async(Dispatchers.Default) {
            pipeline.changes().transformWhile { change ->
                emit(change.state.name)
                isListening.complete(Unit)
                change.state != Pipeline.State.ENDED
            }.toList()
        }
        // The first is the latest, whichever that is: only who listens before gets all of the source's.
        withTimeout(SOON_MS) { isListening.await() }
        pipeline.setSource("$stub&frames=3")
        val expected = listOf("STOPPED", "OPENING", "LOADING", "RUNNING", "ENDED")
        assertEquals(expected, withTimeout(SOON_MS) { untilTheEnd.await() })
        pipeline.stop()
        assertEquals(Pipeline.State.STOPPED, pipeline.changes().first().state)
        val rest = launch(Dispatchers.Default) { pipeline.changes().collect {} }
        pipeline.close()
        withTimeout(SOON_MS) { rest.join() }
    }

    @Test
    fun whatCannotBeUsedIsToldAndCanBeReplaced() {
        maquette.pipeline(ModelBundle.ofFolder("/no/bundle"), Pipeline.Config(densePose = small)).use { pipeline ->
            pipeline.setSource("video:/no/clip.mp4")
            val missing = failure(Status.NOT_FOUND) { pipeline.acquireResult() }
            assertTrue(missing, "/no/clip.mp4" in missing)
            val info = pipeline.info
            assertEquals(Pipeline.State.FAILED to Status.NOT_FOUND, info.state to info.status)
            assertTrue(info.problem, "/no/clip.mp4" in info.problem)
            pipeline.setSource(stub)
            val other = failure(Status.NOT_FOUND) { pipeline.acquireResult() }
            assertTrue(other, "/no/bundle" in other)
            pipeline.setDensePose(bundle, small)
            pipeline.acquireResult()!!.close()
            failure(Status.INVALID_ARGUMENT) { pipeline.setDensePose(bundle, small.copy(maxPeople = 300)) }
            pipeline.setSource("")
            failure(Status.INVALID_ARGUMENT) { pipeline.acquireResult() }
        }
        failure(Status.INVALID_ARGUMENT) { maquette.pipeline(bundle, Pipeline.Config(nice = 20)) }
        failure(Status.INVALID_ARGUMENT) { maquette.pipeline(bundle, Pipeline.Config(resultPoolSize = -1)) }
        val heap = ModelBundle.ofBuffers(mapOf("manifest.json" to java.nio.ByteBuffer.allocate(9)))
        failure(Status.INVALID_ARGUMENT) { maquette.pipeline(heap) }
    }

    @Test
    fun itPausesAndTakesOtherNetworks() {
        maquette.pipeline(bundle, Pipeline.Config(densePose = small)).use { pipeline ->
            pipeline.setSource("$stub&live=1")
            pipeline.acquireResult()!!.use { assertTrue(it.ageMs!! > 0) }
            pipeline.setPaused(true)
            assertEquals(Pipeline.State.PAUSED, pipeline.info.state)
            // One may wait already, and the frame that is processed gives another, however long that takes.
            until("no more results come") {
                val results = pipeline.stats.results
                Thread.sleep(1000)
                results == pipeline.stats.results
            }
            val rest = generateSequence { runCatching { pipeline.acquireResult(0) }.getOrNull() }
            assertTrue(rest.onEach(PipelineResult::close).count() <= 1)
            failure(Status.TIMEOUT) { pipeline.acquireResult(200) }
            pipeline.setPaused(false)
            pipeline.acquireResult()!!.close()
        }
        maquette.pipeline(bundle).use { pipeline ->
            fun hasSurface() = pipeline.acquireResult()!!.use { result ->
                assertEquals(1, result.densePose.people.size)
                result.densePose.copyPlane(DensePoseResult.Plane.U).any { it != 0.toByte() }
            }
            pipeline.setSource(photo)
            assertTrue(hasSurface())
            assertNull(pipeline.acquireResult())
            pipeline.setDensePose(bundle, DensePose.Config(detail = DensePose.Detail.PART))
            assertFalse(hasSurface())
        }
    }

    @Test
    fun itRecordsWhatASourcePlays() = TestFiles.inNewFolder { folder ->
        val file = File(folder, "täke.maqrec").path
        maquette.pipeline(bundle, Pipeline.Config(densePose = small)).use { pipeline ->
            pipeline.setRecording(file)
            pipeline.setSource("$stub&frames=4")
            while (true) (pipeline.acquireResult() ?: break).close()
        }
        maquette.source("rec:$file").use { source ->
            assertEquals(4, generateSequence { source.acquireFrame() }.onEach(Frame::close).count())
        }
    }

    @Test
    fun closingEndsAWaitAndResultsStay() {
        val ofIts = Maquette()
        val pipeline = ofIts.pipeline(bundle, Pipeline.Config(densePose = small))
        ofIts.close()
        pipeline.setSource("$stub&live=1&fps=0.01")
        val result = pipeline.acquireResult()!!
        val waits = CountDownLatch(1)
        var late: PipelineResult? = result
        val waiting = thread {
            waits.countDown()
            late = runCatching { pipeline.acquireResult() }.getOrNull() // if it is closed before: an exception
        }
        waits.await()
        Thread.sleep(50)
        soon {
            pipeline.close()
            waiting.join()
        }
        assertNull(late)
        pipeline.close()
        result.frame.close()
        assertEquals(160, result.densePose.overlay().width)
        assertClosed { result.frame.toBitmap() }
        result.close()
        assertClosed { result.densePose.plane(DensePoseResult.Plane.PART) }
        assertClosed { pipeline.acquireResult() }
        assertClosed { pipeline.setSource(stub) }
        assertClosed { pipeline.setPaused(true) }
        assertClosed { pipeline.stop() }
        assertClosed { pipeline.info }
    }

    @Test
    fun garbageIsCollectedWhileItRuns() {
        maquette.pipeline(bundle, Pipeline.Config(resultPoolSize = 3, densePose = small)).use { pipeline ->
            pipeline.setSource(stub)
            var results = 0
            whileGarbageIsCollected("30 results") {
                try {
                    // Every other result is forgotten.
                    val result = pipeline.acquireResult(100)!!
                    assertEquals(result.frame.widthPx, result.densePose.widthPx)
                    if (++results % 2 == 0) result.close()
                } catch (error: MaquetteException) {
                    assertTrue(error.message, error.status in listOf(Status.POOL_EMPTY, Status.TIMEOUT))
                }
                results >= 30
            }
        }
    }

    @Test
    fun tenThousandPipelinesLeaveNothing() {
        fun make(count: Int) = repeat(count) { maquette.pipeline(bundle).close() }
        make(1000)
        val before = residentMiB()
        make(9000)
        assertTrue("${residentMiB() - before} MiB more", residentMiB() - before < 40)
    }

    @Test
    fun aPipelineThatIsForgottenEndsAlthoughTheLibraryTellsItOfChanges() {
        val config = Pipeline.Config(densePose = small)
        fun start() = maquette.pipeline(bundle, config).also { it.setSource("$stub&live=1") }
        val pipelines = MutableList(5) { start() }
        assertTrue("${threadCount()} threads", threadCount() >= 5)
        pipelines.clear()
        until("their threads end", meanwhile = System::gc) { threadCount() == 0 }
    }
}
