package dev.maquette

import java.util.concurrent.atomic.AtomicInteger
import kotlin.random.Random
import kotlinx.coroutines.CompletableDeferred
import kotlinx.coroutines.Dispatchers
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
import org.junit.Assert.assertTrue
import org.junit.Test

class FlowsTest : AndroidTest() {
    private val maquette = Maquette()

    /** Every frame of the pool can be acquired, so nothing holds one. */
    private fun assertPoolIsFull(source: Source) {
        List(source.info.framePoolSize) { source.acquireFrame()!! }.forEach(Frame::close)
    }

    @Test
    fun aFlowHasAllFramesInOrder() = runBlocking<Unit> {
        maquette.source("stub:people?frames=30&size=64x48", Source.Config(framePoolSize = 1)).use { source ->
            assertEquals(List(30) { it.toLong() }, source.frames().map { it.use(Frame::sequence) }.toList())
            assertEquals(emptyList<Frame>(), source.frames().toList())
            source.seek(0)
            assertEquals(0L, source.frames().first().use(Frame::sequence))
            assertEquals(listOf(1L, 2L), source.frames().map { it.use(Frame::sequence) }.take(2).toList())
            assertPoolIsFull(source)
        }
    }

    @Test
    fun aFlowThatIsCancelledAnywhereKeepsNoFrame() = runBlocking<Unit> {
        val random = Random(7)
        for (options in listOf("", "&live=1&fps=500")) {
            maquette.source("stub:pattern?size=32x24$options", Source.Config(framePoolSize = 2)).use { source ->
                val taken = AtomicInteger()
                repeat(300) { round ->
                    val before = taken.get()
                    val collector = launch(Dispatchers.Default) {
                        source.frames().collect { frame -> frame.use { taken.incrementAndGet() } }
                    }
                    // Half of them before the first frame, the others at any later step.
                    while (round % 2 == 0 && taken.get() == before) Thread.onSpinWait()
                    val until = System.nanoTime() + random.nextLong(3_000_000)
                    while (System.nanoTime() < until) Thread.onSpinWait()
                    collector.cancelAndJoin()
                    assertPoolIsFull(source)
                }
                assertTrue("$taken frames", taken.get() >= 150)
            }
        }
    }

    @Test
    fun cancellingEndsAWait() = runBlocking<Unit> {
        maquette.source("stub:pattern?size=32x24&live=1&fps=0.01").use { source ->
            val begun = CompletableDeferred<Unit>()
            val collector = launch(Dispatchers.Default) {
                source.frames().collect { frame ->
                    frame.close()
                    begun.complete(Unit)
                }
            }
            begun.await()
            delay(100)
            soon { runBlocking { collector.cancelAndJoin() } }
            failure(Status.TIMEOUT) { source.acquireFrame(0) }
        }
    }

    @Test
    fun closingTheSourceEndsItsFlows() = runBlocking<Unit> {
        repeat(5) { round ->
            val source = maquette.source("stub:pattern?size=32x24&live=1&fps=0.01")
            val begun = CompletableDeferred<Unit>()
            val frames = launch(Dispatchers.Default) {
                source.frames().collect { frame ->
                    frame.close()
                    begun.complete(Unit)
                }
            }
            val changes = launch(Dispatchers.Default) { source.changes().collect {} }
            begun.await()
            delay(20L * round)
            source.close()
            withTimeout(SOON_MS) {
                frames.join()
                changes.join()
            }
        }
        val closed = maquette.source("stub:pattern").apply { close() }
        assertClosed { runBlocking { closed.frames().collect(Frame::close) } }
    }

    @Test
    fun whatTheSourceThrowsIsThrownByTheFlow() = runBlocking<Unit> {
        maquette.source("stub:pattern?size=32x24", Source.Config(framePoolSize = 1)).use { source ->
            val held = source.acquireFrame()!!
            failure(Status.POOL_EMPTY) { runBlocking { source.frames().collect(Frame::close) } }
            held.close()
            val error = runCatching { source.frames().collect { it.use { throw ArithmeticException() } } }
            assertTrue(error.exceptionOrNull() is ArithmeticException)
            assertPoolIsFull(source)
        }
    }

    @Test
    fun changesOfACameraComeInOrderToEachCollector() = runBlocking<Unit> {
        val uri = "stub:pattern?size=32x24&fps=50&unplug=300ms@100"
        maquette.source(uri).use { source ->
            val collectors = List(2) { index ->
                val seen = CompletableDeferred<List<Source.State>>()
                // Unconfined: collectors run where the change comes from; closing there must be possible.
                launch(if (index == 0) Dispatchers.Unconfined else Dispatchers.Default) {
                    val states = source.changes().transformWhile { change ->
                        emit(change.state)
                        change.state != Source.State.RECONNECTED
                    }.toList()
                    if (index == 0) source.close()
                    seen.complete(states)
                }
                seen
            }
            val frames = launch(Dispatchers.Default) { source.frames().collect(Frame::close) }
            withTimeout(SOON_MS) {
                // A collector that a busy machine starts late gets the latest state first.
                val expected = listOf("STARTED", "LOST", "RECONNECTING", "RECONNECTED")
                for (seen in collectors) {
                    val names = seen.await().map { it.name }
                    assertEquals(expected.takeLast(names.size), names)
                }
                frames.join()
            }
        }
    }

    @Test
    fun threadsOfTheLibraryThatToldChangesEnd() = runBlocking<Unit> {
        fun openAndClose() = repeat(50) {
            maquette.source("stub:pattern?size=32x24&live=1").use { source ->
                runBlocking { withTimeout(SOON_MS) { source.changes().first() } }
            }
        }
        openAndClose()
        until("no thread of the library is left", meanwhile = System::gc) { threadCount() == 0 }
    }
}
