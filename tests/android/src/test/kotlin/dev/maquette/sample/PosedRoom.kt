package dev.maquette.sample

import dev.maquette.Frame
import dev.maquette.Intrinsics
import dev.maquette.Maquette
import dev.maquette.ModelBundle
import dev.maquette.PinholeCamera
import dev.maquette.PixelFormat
import dev.maquette.RenderedImage
import dev.maquette.Scene
import dev.maquette.TestFiles
import java.io.File
import java.nio.ByteBuffer
import java.nio.ByteOrder
import kotlin.math.abs
import kotlin.random.Random

/**
 * The room of tests/media as ARCore would show it: photos with poses in the convention of OpenGL, in metres, y up, and
 * the points of the cloud in portions, with as many wrong ones of little confidence. Its files have millimetres, z up.
 */
class PosedRoom(
    private val maquette: Maquette,
    everyPhoto: Int,
) : PosedCamera {
    private val capture = maquette.openCapture(TestFiles.room.path)
    private val photos =
        capture.views.indices.filterNot { capture.views[it].isHeldOut }.filterIndexed { at, _ -> at % everyPhoto == 0 }
    private val cloud =
        readPly(File(TestFiles.room, "cloud.ply")).chunked(3).filterIndexed { at, _ -> at % POINTS == 0 }
    private var at = 0

    val photoCount get() = photos.size
    val surePoints get() = cloud.size

    override val problem = null

    override fun next(): TrackedImage? {
        val photo = photos.getOrNull(at) ?: return null.also { Thread.sleep(10) }
        val view = capture.views[photo]
        val (right, down, forward) = view.camera.rotation.chunked(3).map(::turned)
        val columns = listOf(right, down.map { -it }, forward.map { -it }, metres(view.camera.centre))
        val pose = columns.flatMapIndexed { k, column -> column + if (k == 3) 1.0 else 0.0 }
        val random = Random(at)
        val portion = cloud.filterIndexed { k, _ -> k % photos.size == at }
        val points = portion.flatMap { metres(it) + 0.9 + List(3) { random.nextDouble(-3.0, 3.0) } + 0.1 }
        at++
        return TrackedImage(capture.loadView(photo), view.camera.intrinsics, floats(pose), floats(points))
    }

    /** Returns the mean difference between a held-out photo and the rendering from its camera, in grey levels. */
    fun differenceFromHeldOut(scene: Scene, networks: ModelBundle): Double {
        val index = capture.views.indices.first { capture.views[it].isHeldOut }
        val view = capture.views[index].camera
        val intrinsics =
            with(view.intrinsics) {
                Intrinsics(160, 120, fxPx / 4, fyPx / 4, (cxPx + 0.5) / 4 - 0.5, (cyPx + 0.5) / 4 - 0.5)
            }
        val camera = PinholeCamera(intrinsics, view.rotation.chunked(3).flatMap(::turned), metres(view.centre))
        val expected = capture.loadView(index).use { photo -> photo.resize(160, 120).use(::bgr) }
        return maquette.sceneRenderer(scene, networks).use { renderer ->
            renderer.run(camera).use { image ->
                val seen = ByteArray(expected.size).also { image.plane(RenderedImage.Plane.BGR).get(it) }
                seen.zip(expected) { a, b -> abs(a.toUByte().toInt() - b.toUByte().toInt()) }.average()
            }
        }
    }

    override fun close() = capture.close()

    private fun turned(of: List<Double>) = listOf(of[0], of[2], -of[1])

    private fun metres(of: List<Double>) = turned(of).map { it / 1000 }

    private fun floats(of: List<Double>) = FloatArray(of.size) { of[it].toFloat() }

    private fun bgr(frame: Frame): ByteArray {
        val pixels = ByteBuffer.allocateDirect(3 * frame.widthPx * frame.heightPx)
        frame.copyPixels(PixelFormat.BGR8, pixels)
        return ByteArray(pixels.capacity()).also { pixels.get(it) }
    }

    private companion object {
        /** Every so many points of the cloud. */
        const val POINTS = 8

        /** x, y, z of the points; each is three shorts, then three bytes of colour. */
        fun readPly(file: File): List<Double> {
            val bytes = file.readBytes()
            val end = "end_header\n"
            val start = String(bytes, 0, 1000, Charsets.ISO_8859_1).indexOf(end) + end.length
            val values = ByteBuffer.wrap(bytes).order(ByteOrder.LITTLE_ENDIAN)
            return List((bytes.size - start) / 9 * 3) { values.getShort(start + it / 3 * 9 + it % 3 * 2).toDouble() }
        }
    }
}
