package dev.maquette.sample

import dev.maquette.AndroidTest
import dev.maquette.Frame
import dev.maquette.Intrinsics
import dev.maquette.Maquette
import dev.maquette.MaquetteException
import dev.maquette.ModelBundle
import dev.maquette.PixelFormat
import dev.maquette.Plane
import dev.maquette.Status
import dev.maquette.TestFiles
import java.nio.ByteBuffer
import kotlin.math.PI
import kotlin.math.abs
import kotlin.math.cos
import kotlin.math.sin
import org.junit.Assert.assertEquals
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

class PlaceCaptureTest : AndroidTest() {
    private val maquette = Maquette()
    private val networks = ModelBundle.ofFolder(TestFiles.scenesBundle.path)
    private val intrinsics = Intrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)

    /** Noise, or one colour. */
    private fun frame(isSharp: Boolean = true): Frame {
        val pixels = ByteBuffer.allocateDirect(64 * 48)
        repeat(64 * 48) { pixels.put(if (isSharp) (it * 7919 % 251).toByte() else 100) }
        return maquette.frame(PixelFormat.GREY8, 64, 48, Plane(pixels))
    }

    /** At x, turned about y. */
    private fun pose(x: Double, turn: Double = 0.0): FloatArray {
        val (c, s) = cos(turn) to sin(turn)
        val columns = listOf(c, 0.0, -s, 0.0, 0.0, 1.0, 0.0, 0.0, s, 0.0, c, 0.0, x, 1.5, 0.0, 1.0)
        return columns.map(Double::toFloat).toFloatArray()
    }

    private fun image(
        x: Double,
        turn: Double = 0.0,
        isSharp: Boolean = true,
        points: FloatArray = FloatArray(0),
    ) = TrackedImage(frame(isSharp), intrinsics, pose(x, turn), points)

    @Test
    fun aPoseOfOpenGlBecomesOneOfOpenCv() {
        image(2.0, turn = PI / 2).use { image ->
            // Turned to the left by a quarter: it looks along -x, its right is -z.
            val (right, down, forward) = image.camera.rotation.chunked(3)
            for ((expected, seen) in listOf(
                listOf(0.0, 0.0, -1.0) to right,
                listOf(0.0, -1.0, 0.0) to down,
                listOf(-1.0, 0.0, 0.0) to forward,
                listOf(2.0, 1.5, 0.0) to image.camera.centre,
            )) {
                for (axis in 0..2) assertEquals("$expected, $seen", expected[axis], seen[axis], 1e-6)
            }
        }
        frame().use { frame ->
            for ((pose, points) in listOf(FloatArray(12) to FloatArray(0), pose(0.0) to FloatArray(3))) {
                assertThrows(IllegalArgumentException::class.java) { TrackedImage(frame, intrinsics, pose, points) }
            }
        }
    }

    @Test
    fun depthsBecomePointsWhereTheCameraSeesThem() {
        val depthMm = ShortArray(32 * 24) { (if (it % 5 == 0) 0 else 500 + 80 * it).toShort() } // up to 62 m: unsigned
        val confidence = ByteArray(32 * 24) { (it % 256).toByte() }
        for (step in listOf(1, 3)) {
            val points = pointsOfDepth(32, 24, depthMm, confidence, intrinsics, pose(2.0, 0.7), step)
            val seen = points.toList().chunked(4)
            val pixels = (0 until 24 step step).flatMap { y -> (0 until 32 step step).map { x -> x to y } }
            val known = pixels.filter { (x, y) -> (32 * y + x) % 5 != 0 }
            assertEquals(known.size, seen.size)
            val camera = image(2.0, 0.7).use { it.camera }
            for ((pixel, point) in known.zip(seen)) {
                val (x, y) = pixel
                val ray = Vector.of(point.take(3).map(Float::toDouble)) - Vector.of(camera.centre)
                val (a, b, depth) = camera.rotation.chunked(3).map { Vector.of(it) dot ray }
                assertEquals((500 + 80 * (32 * y + x)) / 1000.0, depth, 1e-4)
                // A pixel of the depth image covers four of the picture.
                assertEquals(2 * x + 0.5, 60 * a / depth + 31.5, 1e-3)
                assertEquals(2 * y + 0.5, 60 * b / depth + 23.5, 1e-3)
                assertEquals((32 * y + x) % 256 / 255f, point[3], 1e-6f)
            }
        }
    }

    @Test
    fun onlySharpImagesOfSomethingNewAreKept() {
        PlaceCapture(maxPhotos = 4).use { capture ->
            fun offered(image: TrackedImage) = capture.offer(image).name
            assertEquals("KEPT", offered(image(0.0)))
            assertEquals("NOT_NEW", offered(image(0.05)))
            assertEquals("NOT_NEW", offered(image(0.05, turn = 0.1)))
            assertEquals("KEPT", offered(image(0.05, turn = 0.3)))
            assertEquals("BLURRED", offered(image(0.5, isSharp = false)))
            assertEquals("KEPT", offered(image(0.5)))
            assertEquals("NOT_NEW", offered(image(0.01)))
            // A wall without a pattern is not blurred for ever.
            val verdicts = List(40) { offered(image(0.5 + it, isSharp = false)) }.drop(1)
            assertEquals(setOf("BLURRED"), verdicts.take(5).toSet())
            assertEquals("KEPT", offered(image(100.0)))
            assertEquals("FULL", offered(image(200.0)))
            assertEquals(4, capture.photoCount)
        }
    }

    @Test
    fun pointsThatAreSureEnoughAreOneACell() {
        PlaceCapture().use { capture ->
            val nan = Float.NaN
            val points = floatArrayOf(
                1.001f, 2f, 3f, 0.9f, 1.003f, 2f, 3f, 0.9f, // of one cell
                1.101f, 2f, 3f, 0.9f, -1.001f, 2f, 3f, 0.9f,
                5f, 5f, 5f, 0.1f, 6f, 6f, 6f, nan, nan, 1f, 1f, 1f, 1e9f, 1f, 1f, 1f,
            )
            capture.offer(image(0.0, points = points))
            capture.offer(image(0.0, points = points)) // of images that are not kept, too
            assertEquals(3, capture.pointCount)
        }
    }

    @Test
    fun tooLittleIsASentence() {
        PlaceCapture().use { capture ->
            capture.offer(image(0.0))
            val few = assertThrows(IllegalStateException::class.java) { capture.build(maquette, networks) }
            assertTrue(few.message, "1 photos" in few.message!!)
            repeat(5) { capture.offer(image(1.0 + it)) }
            val flat = assertThrows(IllegalStateException::class.java) { capture.build(maquette, networks) }
            assertTrue(flat.message, "edges" in flat.message!!)
        }
    }

    @Test
    fun aRoomThatWasWalkedThroughLooksLikeItsPhotos() {
        PosedRoom(maquette, everyPhoto = 3).use { room ->
            PlaceCapture().use { capture ->
                while (true) capture.offer(room.next() ?: break)
                assertEquals(room.photoCount, capture.photoCount)
                assertTrue("${capture.pointCount} points", capture.pointCount in 20_000..room.surePoints)
                val stages = mutableListOf<Double>()
                capture.build(maquette, networks, longSidePx = 160) { done, _ -> stages.add(done) }.use { scene ->
                    assertEquals(stages.sorted(), stages)
                    assertEquals(listOf(0.0, 1.0, 0.0), scene.info.up)
                    assertEquals(room.photoCount, scene.buildStats!!.views)
                    val mean = room.differenceFromHeldOut(scene, networks)
                    assertTrue("$mean levels from the photo", mean < 15)
                }
                val error = assertThrows(MaquetteException::class.java) {
                    capture.build(maquette, networks, longSidePx = 160) { _, _ -> false }
                }
                assertEquals(Status.CANCELLED, error.status)
            }
        }
    }
}
