package dev.maquette

import dev.maquette.jni.Native
import dev.maquette.jni.maq_novelty_score
import java.nio.ByteBuffer
import org.junit.Assert.assertArrayEquals
import org.junit.Assert.assertEquals
import org.junit.Assert.assertFalse
import org.junit.Assert.assertTrue
import org.junit.Test

class NoveltyTest : AndroidTest() {
    private val maquette = Maquette()
    private val networks = ModelBundle.ofFolder(TestFiles.predictionBundle.path)
    private val config = Novelty.Config(threads = 1)

    private fun Novelty.pushTexture(number: Int, greys: ByteArray = MovingTexture.greys(0)): Novelty.Score =
        MovingTexture.frame(maquette, number, greys).use(::push)

    private fun Novelty.bitsOfMotion(numbers: IntRange) =
        numbers.map { pushTexture(it, MovingTexture.greys(MovingTexture.STEP_PX * it)).bits }

    @Test
    fun aChangeIsNovelInItsCells() =
        maquette.novelty(networks, config).use { novelty ->
            val first = novelty.pushTexture(0)
            assertTrue(first.isStreamStart)
            assertEquals(1f, first.ratio)
            val still = (1..11).map { novelty.pushTexture(it) }.last()
            assertTrue("${still.bits}", still.bits < 0.1f)
            assertFalse(still.isEvent || still.isStreamStart || still.isCut)

            val changed = MovingTexture.greys(0)
            for (y in 60 until 90) for (x in 80 until 120) changed[160 * y + x] = (255 - changed[160 * y + x]).toByte()
            val score = novelty.pushTexture(12, changed)
            assertEquals(listOf(16, 16, 256), listOf(score.columns, score.rows, score.map.size))
            assertEquals(score.bits.toDouble(), score.map.average(), 1e-4 * score.bits)
            val most = score.map.indices.maxBy { score.map[it] }
            assertTrue("cell $most", most / 16 in 8..11 && most % 16 in 8..11)
            assertTrue("${score.ratio}", score.ratio > 2)

            val cut = novelty.pushTexture(13, ByteArray(160 * 120))
            assertTrue(cut.isCut && cut.isEvent)
            val stats = novelty.stats
            assertEquals(14L to 1L, stats.pushedCount to stats.streamStartCount)
            assertTrue("${stats.eventCount}", stats.eventCount in 1..2)
            assertEquals(1, stats.threads)
            assertTrue("$stats", with(stats) { networkMs > 0 && pushMs >= networkMs + nearestMs + resizeMs })
        }

    @Test
    fun theReconstructionIsMarkedAsPredicted() =
        maquette.novelty(networks, config).use { novelty ->
            assertTrue("push" in failure(Status.INVALID_ARGUMENT) { novelty.reconstruction() })
            novelty.pushTexture(7)
            novelty.reconstruction().use { image ->
                assertEquals(64 to 64, image.widthPx to image.heightPx)
                assertEquals(PixelFormat.RGB8, image.format)
                assertEquals(700_000_000L to 7L, image.timestampNs to image.sequence)
                assertEquals(Frame.Origin(0, 0, 700_000_000, 7), image.origin)
                val seen = MovingTexture.greysOf(image).map { it.toInt() and 0xFF }
                val truth = MovingTexture.frame(maquette, 7, MovingTexture.greys(0)).use { frame ->
                    frame.resize(64, 64).use { small -> MovingTexture.greysOf(small).map { it.toInt() and 0xFF } }
                }
                val (seenMean, truthMean) = seen.average() to truth.average()
                val together = seen.indices.sumOf { (seen[it] - seenMean) * (truth[it] - truthMean) }
                assertTrue("it is the frame, not its inverse or noise", together > 0)
            }
            val held = List(4) { novelty.reconstruction() }
            failure(Status.POOL_EMPTY) { novelty.reconstruction() }
            novelty.close()
            assertEquals(0L, held[3].origin!!.horizonNs)
            held.forEach(Frame::close)
        }

    @Test
    fun aStreamBeginsAnewOnRequestAndWhereTimeGoesBack() =
        maquette.novelty(networks, config).use { novelty ->
            assertEquals(listOf(true, false), (0..1).map { novelty.pushTexture(it).isStreamStart })
            novelty.reset()
            assertTrue(novelty.pushTexture(2).isStreamStart)
            assertTrue("an earlier time", novelty.pushTexture(1).isStreamStart)
            assertTrue("a pause", novelty.pushTexture(20).isStreamStart)
            assertEquals(4L, novelty.stats.streamStartCount)
        }

    @Test
    fun streamsShareNetworksAndABundleInMemoryGivesTheSame() {
        val first = maquette.novelty(networks, config)
        val alone = first.bitsOfMotion(0..3)
        val second = maquette.novelty(sharedWith = first)
        assertEquals(alone, second.bitsOfMotion(0..3))
        first.close()
        second.reset()
        assertEquals("the other may be closed", alone, second.bitsOfMotion(0..3))
        assertClosed { maquette.novelty(sharedWith = first) }
        val events = listOf(1.0001f, 1e6f).map { ratio ->
            maquette.novelty(sharedWith = second, eventRatio = ratio).use { third ->
                for (number in 0..11) third.pushTexture(number)
                third.stats.eventCount
            }
        }
        assertTrue("$events", events[0] > events[1])
        second.close()
        val inMemory = ModelBundle.ofBuffers(TestFiles.bundleInMemory(TestFiles.predictionBundle))
        maquette.novelty(inMemory, config).use { assertEquals(alone, it.bitsOfMotion(0..3)) }
    }

    @Test
    fun framesOfAnySizeAndFormatHaveAScore() =
        maquette.novelty(networks, config).use { novelty ->
            maquette.decode(TestFiles.photo.readBytes()).use { assertTrue(novelty.push(it).isStreamStart) }
            val dot = Plane(ByteBuffer.allocateDirect(1))
            maquette.frame(PixelFormat.GREY8, 1, 1, dot).use { assertTrue(novelty.push(it).isStreamStart) }
            val flat = ByteBuffer.allocateDirect(3000)
            for ((width, height) in listOf(3000 to 1, 1 to 3000)) {
                maquette.frame(PixelFormat.GREY8, width, height, Plane(flat)).use { frame ->
                    assertTrue(novelty.push(frame).bits.isFinite())
                }
            }
            val planes = Plane(ByteBuffer.allocateDirect(64 * 48)) to Plane(ByteBuffer.allocateDirect(64 * 24))
            maquette.frame(PixelFormat.NV12, 64, 48, planes.first, planes.second).use { frame ->
                assertTrue(novelty.push(frame).map.all { it >= 0 })
            }
        }

    @Test
    fun wrongInputIsAnExceptionThatSaysWhatToDo() {
        for (ratio in listOf(1f, 0.5f, -4f, 2e6f, Float.NaN)) {
            val said = failure(Status.INVALID_ARGUMENT) { maquette.novelty(networks, config.copy(eventRatio = ratio)) }
            assertTrue(said, "event_ratio" in said)
        }
        failure(Status.INVALID_ARGUMENT) { maquette.novelty(networks, Novelty.Config(threads = 65)) }
        failure(Status.UNSUPPORTED) { maquette.novelty(ModelBundle.ofFolder(TestFiles.edgesBundle.path)) }
        failure(Status.NOT_FOUND) { maquette.novelty(ModelBundle.ofFolder("/nowhere")) }
        val files = TestFiles.bundleInMemory(TestFiles.predictionBundle)
        for (name in files.keys - setOf("MODEL_CARD.md", "manifest.json")) {
            val damaged = files + (name to TestFiles.direct(ByteArray(1000)))
            val said = failure(Status.BAD_BUNDLE) { maquette.novelty(ModelBundle.ofBuffers(damaged)) }
            assertTrue(said, name in said)
            failure(Status.BAD_BUNDLE) { maquette.novelty(ModelBundle.ofBuffers(files - name)) }
        }
        maquette.novelty(networks, config).use { novelty ->
            failure(Status.INVALID_ARGUMENT) { maquette.novelty(sharedWith = novelty, eventRatio = 0.5f) }
            val before = novelty.bitsOfMotion(0..1)
            val depth = ByteBuffer.allocateDirect(2 * 160 * 120)
            maquette.frame(PixelFormat.DEPTH16, 160, 120, Plane(depth)).use {
                failure(Status.UNSUPPORTED) { novelty.push(it) }
            }
            assertEquals("as it was before", 2L, novelty.stats.pushedCount)
            novelty.reset()
            assertArrayEquals(before.toFloatArray(), novelty.bitsOfMotion(0..1).toFloatArray(), 0f)
            val closed = MovingTexture.frame(maquette, 2).apply { close() }
            assertClosed { novelty.push(closed) }
        }
        failure(Status.INVALID_ARGUMENT) { Native.maq_novelty_push(0, 0, maq_novelty_score()) }
        failure(Status.INVALID_ARGUMENT) { Native.maq_novelty_acquire_reconstruction(0) }
        failure(Status.INVALID_ARGUMENT) { Native.maq_novelty_create(0, null) }
    }

    @Test
    fun itIsClosedInAnyOrderAndNotUsedAfterwards() {
        val ofIts = Maquette()
        val novelty = ofIts.novelty(networks, config)
        ofIts.close()
        assertClosed { ofIts.novelty(networks) }
        assertTrue(novelty.pushTexture(0).isStreamStart)
        novelty.close()
        novelty.close()
        assertClosed { novelty.pushTexture(1) }
        assertClosed { novelty.reconstruction() }
        assertClosed { novelty.reset() }
        assertClosed { novelty.stats }
    }

    @Test
    fun tenThousandStreamsLeaveNothing() =
        maquette.novelty(networks, config).use { first ->
            fun make(count: Int) = repeat(count) { maquette.novelty(sharedWith = first).close() }
            make(1000)
            val before = residentMiB()
            make(9000)
            assertTrue("${residentMiB() - before} MiB more", residentMiB() - before < 40)
        }
}
