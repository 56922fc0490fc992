package dev.maquette

import dev.maquette.jni.NativePrediction
import java.nio.ByteBuffer
import org.junit.Assert.assertArrayEquals
import org.junit.Assert.assertEquals
import org.junit.Assert.assertFalse
import org.junit.Assert.assertTrue
import org.junit.Test

class SurpriseTest : AndroidTest() {
    private val maquette = Maquette()
    private val networks = ModelBundle.ofFolder(TestFiles.predictionBundle.path)
    private val config = Surprise.Config(threads = 1)

    private fun Surprise.pushTexture(number: Int, greys: ByteArray = MovingTexture.greys(0)): Surprise.Score =
        MovingTexture.frame(maquette, number, greys).use(::push)

    private fun Surprise.bitsOfMotion(numbers: IntRange) =
        numbers.map { pushTexture(it, MovingTexture.greys(MovingTexture.STEP_PX * it)).bits }

    @Test
    fun whatChangesIsSurprisingWhereItChanges() =
        maquette.surprise(networks, config).use { surprise ->
            val first = surprise.pushTexture(0)
            assertTrue(first.isStart)
            assertEquals(1f, first.ratio)
            val still = (1..11).map { surprise.pushTexture(it) }.last()
            assertTrue("${still.bits}", still.bits < 0.1f)
            assertFalse(still.isEvent || still.isStart || still.isCut)

            val changed = MovingTexture.greys(0)
            for (y in 60 until 90) for (x in 80 until 120) changed[160 * y + x] = (255 - changed[160 * y + x]).toByte()
            val score = surprise.pushTexture(12, changed)
            assertEquals(listOf(16, 16, 256), listOf(score.columns, score.rows, score.map.size))
            assertEquals(score.bits.toDouble(), score.map.average(), 1e-4 * score.bits)
            val most = score.map.indices.maxBy { score.map[it] }
            assertTrue("cell $most", most / 16 in 8..11 && most % 16 in 8..11)
            assertTrue("${score.ratio}", score.ratio > 2)

            val cut = surprise.pushTexture(13, ByteArray(160 * 120))
            assertTrue(cut.isCut && cut.isEvent)
            val stats = surprise.stats
            assertEquals(14L to 1L, stats.pushedCount to stats.startCount)
            assertTrue("${stats.eventCount}", stats.eventCount in 1..2)
            assertEquals(1, stats.threads)
            assertTrue("$stats", with(stats) { networkMs > 0 && pushMs >= networkMs + nearestMs + resizeMs })
        }

    @Test
    fun whatTheNetworkSawIsAPictureThatSaysThatNoCameraTookIt() =
        maquette.surprise(networks, config).use { surprise ->
            assertTrue("push" in failure(Status.INVALID_ARGUMENT) { surprise.rebuilt() })
            surprise.pushTexture(7)
            surprise.rebuilt().use { picture ->
                assertEquals(64 to 64, picture.widthPx to picture.heightPx)
                assertEquals(PixelFormat.RGB8, picture.format)
                assertEquals(700_000_000L to 7L, picture.timestampNs to picture.sequence)
                assertEquals(Frame.Origin(0, 0, 700_000_000, 7), picture.origin)
                val seen = MovingTexture.greysOf(picture).map { it.toInt() and 0xFF }
                val truth = MovingTexture.frame(maquette, 7, MovingTexture.greys(0)).use { frame ->
                    frame.resize(64, 64).use { small -> MovingTexture.greysOf(small).map { it.toInt() and 0xFF } }
                }
                val (seenMean, truthMean) = seen.average() to truth.average()
                val together = seen.indices.sumOf { (seen[it] - seenMean) * (truth[it] - truthMean) }
                assertTrue("it is the frame, not its inverse or noise", together > 0)
            }
            val held = List(4) { surprise.rebuilt() }
            failure(Status.POOL_EMPTY) { surprise.rebuilt() }
            surprise.close()
            assertEquals(0L, held[3].origin!!.horizonNs)
            held.forEach(Frame::close)
        }

    @Test
    fun aStreamBeginsAnewOnRequestAndWhereTimeGoesBack() =
        maquette.surprise(networks, config).use { surprise ->
            assertEquals(listOf(true, false), (0..1).map { surprise.pushTexture(it).isStart })
            surprise.reset()
            assertTrue(surprise.pushTexture(2).isStart)
            assertTrue("an earlier time", surprise.pushTexture(1).isStart)
            assertTrue("a pause", surprise.pushTexture(20).isStart)
            assertEquals(4L, surprise.stats.startCount)
        }

    @Test
    fun streamsShareNetworksAndABundleInMemoryGivesTheSame() {
        val first = maquette.surprise(networks, config)
        val alone = first.bitsOfMotion(0..3)
        val second = maquette.surprise(networksOf = first)
        assertEquals(alone, second.bitsOfMotion(0..3))
        first.close()
        second.reset()
        assertEquals("the other may be closed", alone, second.bitsOfMotion(0..3))
        assertClosed { maquette.surprise(networksOf = first) }
        val events = listOf(1.0001f, 1e6f).map { ratio ->
            maquette.surprise(networksOf = second, eventRatio = ratio).use { third ->
                for (number in 0..11) third.pushTexture(number)
                third.stats.eventCount
            }
        }
        assertTrue("$events", events[0] > events[1])
        second.close()
        val inMemory = ModelBundle.ofBuffers(TestFiles.bundleInMemory(TestFiles.predictionBundle))
        maquette.surprise(inMemory, config).use { assertEquals(alone, it.bitsOfMotion(0..3)) }
    }

    @Test
    fun framesOfAnySizeAndFormatHaveAScore() =
        maquette.surprise(networks, config).use { surprise ->
            maquette.decode(TestFiles.photo.readBytes()).use { assertTrue(surprise.push(it).isStart) }
            val dot = Plane(ByteBuffer.allocateDirect(1))
            maquette.frame(PixelFormat.GREY8, 1, 1, dot).use { assertTrue(surprise.push(it).isStart) }
            val flat = ByteBuffer.allocateDirect(3000)
            for ((width, height) in listOf(3000 to 1, 1 to 3000)) {
                maquette.frame(PixelFormat.GREY8, width, height, Plane(flat)).use { frame ->
                    assertTrue(surprise.push(frame).bits.isFinite())
                }
            }
            val planes = Plane(ByteBuffer.allocateDirect(64 * 48)) to Plane(ByteBuffer.allocateDirect(64 * 24))
            maquette.frame(PixelFormat.NV12, 64, 48, planes.first, planes.second).use { frame ->
                assertTrue(surprise.push(frame).map.all { it >= 0 })
            }
        }

    @Test
    fun wrongInputIsAnExceptionThatSaysWhatToDo() {
        for (ratio in listOf(1f, 0f, -4f, 2e6f, Float.NaN)) {
            val said = failure(Status.INVALID_ARGUMENT) { maquette.surprise(networks, config.copy(eventRatio = ratio)) }
            assertTrue(said, "event_ratio" in said)
        }
        failure(Status.INVALID_ARGUMENT) { maquette.surprise(networks, Surprise.Config(threads = 65)) }
        failure(Status.UNSUPPORTED) { maquette.surprise(ModelBundle.ofFolder(TestFiles.edgesBundle.path)) }
        failure(Status.NOT_FOUND) { maquette.surprise(ModelBundle.ofFolder("/nowhere")) }
        val files = TestFiles.bundleInMemory(TestFiles.predictionBundle)
        for (name in files.keys - setOf("MODEL_CARD.md", "manifest.json")) {
            val damaged = files + (name to TestFiles.direct(ByteArray(1000)))
            val said = failure(Status.BAD_BUNDLE) { maquette.surprise(ModelBundle.ofBuffers(damaged)) }
            assertTrue(said, name in said)
            failure(Status.BAD_BUNDLE) { maquette.surprise(ModelBundle.ofBuffers(files - name)) }
        }
        maquette.surprise(networks, config).use { surprise ->
            failure(Status.INVALID_ARGUMENT) { maquette.surprise(networksOf = surprise, eventRatio = 0.5f) }
            val before = surprise.bitsOfMotion(0..1)
            val depth = ByteBuffer.allocateDirect(2 * 160 * 120)
            maquette.frame(PixelFormat.DEPTH16, 160, 120, Plane(depth)).use {
                failure(Status.UNSUPPORTED) { surprise.push(it) }
            }
            assertEquals("as it was before", 2L, surprise.stats.pushedCount)
            surprise.reset()
            assertArrayEquals(before.toFloatArray(), surprise.bitsOfMotion(0..1).toFloatArray(), 0f)
            val closed = MovingTexture.frame(maquette, 2).apply { close() }
            assertClosed { surprise.push(closed) }
        }
        failure(Status.INVALID_ARGUMENT) { NativePrediction.pushToSurprise(0, 0) }
        failure(Status.INVALID_ARGUMENT) { NativePrediction.rebuilt(0) }
        failure(Status.INTERNAL) {
            NativePrediction.createSurprise(0, null, null, null, DoubleArray(2), 0)
        }
    }

    @Test
    fun itIsClosedInAnyOrderAndNotUsedAfterwards() {
        val ofIts = Maquette()
        val surprise = ofIts.surprise(networks, config)
        ofIts.close()
        assertClosed { ofIts.surprise(networks) }
        assertTrue(surprise.pushTexture(0).isStart)
        surprise.close()
        surprise.close()
        assertClosed { surprise.pushTexture(1) }
        assertClosed { surprise.rebuilt() }
        assertClosed { surprise.reset() }
        assertClosed { surprise.stats }
    }

    @Test
    fun tenThousandStreamsLeaveNothing() =
        maquette.surprise(networks, config).use { first ->
            fun make(count: Int) = repeat(count) { maquette.surprise(networksOf = first).close() }
            make(1000)
            val before = residentMiB()
            make(9000)
            assertTrue("${residentMiB() - before} MiB more", residentMiB() - before < 40)
        }
}
