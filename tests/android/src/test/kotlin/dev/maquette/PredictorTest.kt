package dev.maquette

import dev.maquette.jni.Memory
import dev.maquette.jni.Native
import dev.maquette.jni.maq_predictor_stats
import java.io.File
import java.lang.reflect.InvocationTargetException
import java.nio.ByteBuffer
import kotlin.concurrent.thread
import kotlin.math.abs
import org.junit.Assert.assertArrayEquals
import org.junit.Assert.assertEquals
import org.junit.Assert.assertNull
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

class PredictorTest : AndroidTest() {
    private val maquette = Maquette()
    private val byMotion = Predictor.Config(threads = 1, method = Predictor.Method.MOTION)

    private fun Predictor.pushTexture(numbers: IntRange) {
        for (number in numbers) MovingTexture.frame(maquette, number).use(::push)
    }

    /** Runs [work] with a predictor that has seen the texture move in frames 0 to 2. */
    private fun <T> withMoving(config: Predictor.Config = byMotion, work: (Predictor) -> T): T =
        maquette.predictor(config).use { predictor ->
            predictor.pushTexture(0..2)
            work(predictor)
        }

    /** Mean difference of a predicted frame from the texture, where all of it was seen before. */
    private fun error(made: Frame, shiftPx: Int): Double {
        val (seen, asked) = MovingTexture.greysOf(made) to MovingTexture.greys(shiftPx)
        val inside = seen.indices.filter { k ->
            k % MovingTexture.WIDTH_PX in 40 until 120 && k / MovingTexture.WIDTH_PX in 20 until 100
        }
        return inside.map { k -> abs((seen[k].toInt() and 0xFF) - (asked[k].toInt() and 0xFF)) }.average()
    }

    @Test
    fun motionGoesOnInAFrameThatIsMarkedAsPredicted() =
        withMoving { predictor ->
            val made = predictor.predict(0.2)
            made.use {
                val (right, still) = error(made, 16) to error(made, 8)
                assertTrue("$right, $still", right < 2 && still > 10)
                assertEquals(160 to 120, made.widthPx to made.heightPx)
                assertEquals(PixelFormat.RGB8 to Clock.MEDIA, made.format to made.clock)
                assertEquals(400_000_000L to 2L, made.timestampNs to made.sequence)
                assertEquals(Frame.Origin(200_000_000, 200_000_000, 200_000_000, 2), made.origin)
                made.resize(80, 60).use { assertEquals(made.origin, it.origin) }
            }
            assertClosed { made.origin }
            val stats = predictor.stats
            assertEquals(Predictor.Method.MOTION to 1.0, stats.method to stats.motionFraction)
            assertEquals(listOf(3L, 1L, 0L), with(stats) { listOf(pushedCount, predictedCount, resetCount) })
            assertTrue("$stats", with(stats) { flowMs > 0 && pushMs >= flowMs && predictMs >= warpMs && warpMs > 0 })
        }

    @Test
    fun capturedFramesHaveNoOrigin() {
        MovingTexture.frame(maquette, 0).use { assertNull(it.origin) }
        maquette.decode(TestFiles.photo.readBytes()).use { assertNull(it.origin) }
        maquette.source("stub:pattern?size=64x48&live=1&fps=100").use { source ->
            source.acquireFrame()!!.use { assertNull(it.origin) }
        }
    }

    @Test
    fun theLastFrameIsRepeatedWhereThatIsTheMethodOrNothingElseIsKnown() {
        for ((method, last) in listOf(Predictor.Method.LAST to 2, Predictor.Method.AUTO to 0)) {
            maquette.predictor(Predictor.Config(method = method)).use { predictor ->
                predictor.pushTexture(0..last)
                val greys = MovingTexture.greys(MovingTexture.STEP_PX * last)
                predictor.predict(1.0).use { assertArrayEquals(greys, MovingTexture.greysOf(it)) }
                assertEquals(Predictor.Method.LAST to 0.0, with(predictor.stats) { this.method to motionFraction })
            }
        }
    }

    @Test
    fun methodsAreMixedByHowRightTheyWere() =
        withMoving(Predictor.Config(threads = 1)) { predictor ->
            predictor.pushTexture(3..12)
            predictor.predict(0.1).use { made ->
                assertTrue("${error(made, 52)}", error(made, 52) < 4)
                val fraction = predictor.stats.motionFraction
                assertTrue("$fraction", fraction > 0.5)
            }
        }

    @Test
    fun whatCameBeforeIsForgottenOnRequestAndAfterAPause() =
        withMoving { predictor ->
            predictor.reset()
            assertTrue("push" in failure(Status.INVALID_ARGUMENT) { predictor.predict(0.1) })
            predictor.pushTexture(3..4)
            val before = predictor.stats.resetCount
            predictor.pushTexture(40..40)
            assertEquals(before + 1, predictor.stats.resetCount)
            predictor.predict(0.1).use { assertTrue(error(it, 160) < 1) }
        }

    @Test
    fun samplesDependOnTheSeedAloneAndHaveAnEntropyMap() {
        val networks = ModelBundle.ofFolder(TestFiles.predictionBundle.path)
        val sampling = Predictor.Config(threads = 1, method = Predictor.Method.SAMPLED, temperature = 1f, seed = -2)
        maquette.predictor(networks, sampling).use { predictor ->
            predictor.pushTexture(0..2)
            predictor.sample(3, 2, stepS = 0.1)
            val bits = predictor.entropyMap(1, 2)
            assertEquals(256, bits.size)
            with(predictor.stats) {
                assertEquals(listOf(6, 2 * 256), listOf(sampledFrameCount, stepCount))
                assertTrue(networksMs > 0)
            }
            assertTrue("${bits.average()}", bits.average() in 0.3..9.0)
            predictor.acquireSample(1, 2).use { assertEquals(200_000_000L, it.origin!!.horizonNs) }
            predictor.sample(2, 2, stepS = 0.1)
            assertArrayEquals(bits, predictor.entropyMap(1, 2), 0f)
            assertTrue("of 2 samples" in failure(Status.INVALID_ARGUMENT) { predictor.acquireSample(2, 1) })
            failure(Status.INVALID_ARGUMENT) { predictor.sample(-1, 1, 0.1) }
            predictor.cancel()
            failure(Status.CANCELLED) { predictor.sample(1, 1, stepS = 0.1) }
            predictor.sample(1, 1, stepS = 0.1)
        }
        for (wrong in listOf(sampling.copy(temperature = -1f))) {
            failure(Status.INVALID_ARGUMENT) { maquette.predictor(networks, wrong) }
        }
        withMoving { failure(Status.UNSUPPORTED) { it.sample(1, 1, 0.1) } }
        withMoving { failure(Status.UNSUPPORTED) { it.entropyMap(0, 1) } }
    }

    @Test
    fun framesThatAreHeldAreAsManyAsThePoolHasAndOutliveThePredictor() {
        val predictor = maquette.predictor(byMotion.copy(framePoolSize = 2))
        predictor.pushTexture(0..1)
        val held = List(2) { predictor.predict(0.1 * it) }
        failure(Status.POOL_EMPTY) { predictor.predict(0.0) }
        held[0].close()
        predictor.predict(0.0).close()
        predictor.close()
        assertEquals(100_000_000L, held[1].origin!!.horizonNs)
        assertTrue(error(held[1], 8) < 2)
        held[1].close()
    }

    @Test
    fun wrongInputIsAnExceptionThatSaysWhatToDo() =
        withMoving<Unit> { predictor ->
            for (ahead in listOf(-0.1, 10.1, Double.NaN, Double.POSITIVE_INFINITY)) {
                val said = failure(Status.INVALID_ARGUMENT) { predictor.predict(ahead) }
                assertTrue(said, "ahead_s" in said)
            }
            predictor.predict(10.0).close()
            val wrong = listOf(
                byMotion.copy(threads = -1) to "threads",
                byMotion.copy(threads = 65) to "threads",
                byMotion.copy(framePoolSize = -1) to "frame_pool_size",
                byMotion.copy(framePoolSize = 65) to "frame_pool_size",
            )
            for ((config, name) in wrong) {
                assertTrue(name in failure(Status.INVALID_ARGUMENT) { maquette.predictor(config) })
            }
            val depth = ByteBuffer.allocateDirect(2 * 160 * 120)
            maquette.frame(PixelFormat.DEPTH16, 160, 120, Plane(depth)).use {
                failure(Status.UNSUPPORTED) { predictor.push(it) }
            }
            // A frame of one pixel, and one of another size: streams of their own.
            maquette.frame(PixelFormat.GREY8, 1, 1, Plane(ByteBuffer.allocateDirect(1)), timestampNs = 1).use {
                predictor.push(it)
            }
            predictor.predict(0.5).use { assertEquals(1 to 1, it.widthPx to it.heightPx) }
            val closed = MovingTexture.frame(maquette, 3).apply { close() }
            assertClosed { predictor.push(closed) }
        }

    @Test
    fun javasNullsAreExceptions() =
        withMoving<Unit> { predictor ->
            val push = Predictor::class.java.getMethod("push", Frame::class.java)
            val refused = assertThrows(InvocationTargetException::class.java) { push.invoke(predictor, null) }
            val said = (refused.cause as NullPointerException).message!!
            assertTrue(said, "frame" in said)
            // Native methods, as if the Kotlin classes had let them pass.
            failure(Status.INVALID_ARGUMENT) { Native.maq_predictor_create(0, byMotion.native(null)) }
            failure(Status.INVALID_ARGUMENT) { Native.maq_predictor_push(0, 0) }
            failure(Status.INVALID_ARGUMENT) { Native.maq_predictor_predict(0, 0.1) }
            failure(Status.INVALID_ARGUMENT) { Native.maq_predictor_get_stats(0, maq_predictor_stats()) }
            failure(Status.INVALID_ARGUMENT) { Native.maq_predictor_get_stats(0, null) }
            maquette.predictor(byMotion).use { predictor ->
                // A struct of another size: of a Kotlin class that does not fit the library.
                val short = Memory(maq_predictor_stats().sizeBytes).apply { int(0, sizeBytes - 4) }
                val said = failure(Status.INVALID_ARGUMENT) { predictor.handle.use { Native.maq_predictor_get_stats(it, short) } }
                assertTrue(said, "struct_size" in said)
            }
        }

    @Test
    fun callsAtTheSameTimeAreRefusedAndClosingWaitsForNoneOfThem() {
        repeat(20) {
            val predictor = maquette.predictor(byMotion)
            val frames = List(6) { MovingTexture.frame(maquette, it) }
            val callers = List(3) {
                thread {
                    try {
                        for (round in 0 until 1000) {
                            try {
                                predictor.push(frames[round % frames.size])
                                predictor.predict(0.1).close()
                                predictor.stats
                            } catch (error: MaquetteException) {
                                if (error.status != Status.INVALID_ARGUMENT) throw error
                            }
                        }
                    } catch (_: IllegalStateException) {
                        // closed
                    }
                }
            }
            Thread.sleep(10L * (it % 4))
            soon {
                predictor.close()
                callers.forEach(Thread::join)
            }
            frames.forEach(Frame::close)
            assertClosed { predictor.stats }
        }
    }

    @Test
    fun itIsClosedInAnyOrderAndNotUsedAfterwards() {
        val ofIts = Maquette()
        val predictor = ofIts.predictor(byMotion)
        ofIts.close()
        assertClosed { ofIts.predictor() }
        predictor.pushTexture(0..1)
        predictor.close()
        predictor.close()
        MovingTexture.frame(maquette, 2).use { frame -> assertClosed { predictor.push(frame) } }
        assertClosed { predictor.predict(0.1) }
        assertClosed { predictor.reset() }
        assertClosed { predictor.stats }
    }

    @Test
    fun recordersKeepPredictedFramesOnRequestAndMarkThem() =
        TestFiles.inNewFolder { folder ->
            withMoving { predictor ->
                predictor.predict(0.1).use { made ->
                    maquette.recorder(File(folder, "a.maqrec").path).use { recorder ->
                        val said = failure(Status.UNSUPPORTED) { recorder.add(made) }
                        assertTrue(said, "predicted" in said)
                    }
                    val path = File(folder, "b.maqrec").path
                    maquette.recorder(path, keepPredicted = true).use { recorder ->
                        MovingTexture.frame(maquette, 2).use(recorder::add)
                        recorder.add(made)
                        recorder.finish()
                    }
                    maquette.source("rec:$path").use { source ->
                        source.acquireFrame()!!.use { assertNull(it.origin) }
                        source.acquireFrame()!!.use { assertEquals(100_000_000L, it.origin!!.horizonNs) }
                    }
                }
            }
        }

    @Test
    fun tenThousandPredictorsLeaveNothing() {
        MovingTexture.frame(maquette, 0).use { frame ->
            fun use(count: Int) =
                repeat(count) {
                    maquette.predictor(byMotion).use { predictor ->
                        predictor.push(frame)
                        predictor.predict(0.1).use { made -> assertEquals(100_000_000L, made.origin!!.horizonNs) }
                    }
                }
            use(1000)
            val before = residentMiB()
            use(9000)
            assertTrue("${residentMiB() - before} MiB more", residentMiB() - before < 40)
        }
    }
}
