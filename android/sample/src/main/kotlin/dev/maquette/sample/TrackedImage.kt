package dev.maquette.sample

import dev.maquette.Frame
import dev.maquette.Intrinsics
import dev.maquette.PinholeCamera

/**
 * An image of a camera that knows where it is, in the conventions of ARCore, which are those of OpenGL.
 *
 * @property cameraToWorld 16 numbers, column by column. Of the camera: x to the right of the image as it lies in
 *   memory, y up, z backwards. Of the world: y up, in metres.
 * @property points of the world that were found so far or now: x, y, z and a confidence, 0 to 1, of each.
 * @property degreesToUpright by which the image has to be turned clockwise to be shown: 0, 90, 180 or 270.
 */
class TrackedImage(
    val frame: Frame,
    private val intrinsics: Intrinsics,
    private val cameraToWorld: FloatArray,
    val points: FloatArray,
    val degreesToUpright: Int = 0,
) : AutoCloseable {
    init {
        require(cameraToWorld.size == 16) { "The pose has ${cameraToWorld.size} numbers; it needs 16." }
        require(points.size % 4 == 0) { "The points have ${points.size} numbers; each needs 4." }
    }

    /** The camera in the convention of Maquette: y down, z forward, world to camera. */
    val camera: PinholeCamera
        get() {
            fun axis(column: Int, sign: Double) = List(3) { sign * cameraToWorld[4 * column + it] }
            return PinholeCamera(intrinsics, axis(0, 1.0) + axis(1, -1.0) + axis(2, -1.0), axis(3, 1.0))
        }

    override fun close() = frame.close()
}

/** A camera that knows where it is: ARCore's, or what a test plays. All functions are called on one thread. */
interface PosedCamera : AutoCloseable {
    /** Waits shortly for the next image; null while there is none, or while the camera does not know where it is. */
    fun next(): TrackedImage?

    /** Why no images come, and what to do; null while they come. */
    val problem: String?
}

/**
 * Points of a depth image, as [TrackedImage.points].
 *
 * @param depthMm along the optical axis, row by row; 0: unknown.
 * @param confidence of each pixel, 0 to 255.
 * @param intrinsics of the camera, of any size with the same view.
 * @param cameraToWorld as in [TrackedImage].
 * @param step every so many pixels, across and down.
 */
fun pointsOfDepth(
    widthPx: Int,
    heightPx: Int,
    depthMm: ShortArray,
    confidence: ByteArray,
    intrinsics: Intrinsics,
    cameraToWorld: FloatArray,
    step: Int = 1,
): FloatArray {
    require(depthMm.size == widthPx * heightPx && confidence.size == depthMm.size) { "The size is another." }
    val (scaleX, scaleY) = intrinsics.widthPx.toDouble() / widthPx to intrinsics.heightPx.toDouble() / heightPx
    val points = FloatArray(4 * ((widthPx + step - 1) / step) * ((heightPx + step - 1) / step))
    var count = 0
    for (row in 0 until heightPx step step) for (column in 0 until widthPx step step) {
        val at = row * widthPx + column
        val depth = (depthMm[at].toInt() and 0xFFFF) / 1000.0
        if (depth == 0.0) continue
        val x = ((column + 0.5) * scaleX - 0.5 - intrinsics.cxPx) / intrinsics.fxPx * depth
        val y = ((row + 0.5) * scaleY - 0.5 - intrinsics.cyPx) / intrinsics.fyPx * depth
        for (axis in 0..2) {
            val m = { k: Int -> cameraToWorld[4 * k + axis] }
            points[4 * count + axis] = (m(0) * x - m(1) * y - m(2) * depth + m(3)).toFloat()
        }
        points[4 * count++ + 3] = (confidence[at].toInt() and 0xFF) / 255f
    }
    return points.copyOf(4 * count)
}
