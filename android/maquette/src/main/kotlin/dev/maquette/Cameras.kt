package dev.maquette

import dev.maquette.jni.*

/**
 * How a camera maps directions to pixels, in the convention of OpenCV: x to the right, y down, z forward; the centre of
 * the top left pixel is (0, 0). With x' = x / z and y' = y / z, distorted by the rational model, a point appears at
 * (fx x' + cx, fy y' + cy).
 *
 * @property widthPx of the picture that the other numbers refer to.
 * @property fxPx focal length in pixels, positive.
 * @property cxPx the principal point; it may lie outside the picture.
 * @property distortion k1, k2, p1, p2, k3, k4, k5, k6 of the rational model; eight zeros: none.
 */
data class Intrinsics(
    val widthPx: Int,
    val heightPx: Int,
    val fxPx: Double,
    val fyPx: Double,
    val cxPx: Double,
    val cyPx: Double,
    val distortion: List<Double> = List(8) { 0.0 },
) {
    init {
        require(distortion.size == 8) { "The distortion has ${distortion.size} numbers; it needs 8." }
    }

    internal fun writeTo(native: maq_intrinsics) {
        native.width_px = widthPx
        native.height_px = heightPx
        native.fx_px = fxPx
        native.fy_px = fyPx
        native.cx_px = cxPx
        native.cy_px = cyPx
        native.distortion = distortion
    }

    internal companion object {
        fun of(native: maq_intrinsics) =
            with(native) { Intrinsics(width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion) }
    }
}

/**
 * A camera with its pose. A point X of the world has the camera coordinates `rotation * (X - centre)`.
 *
 * @property rotation world to camera, 9 numbers row by row; right-handed and orthonormal (to 0.001).
 * @property centre the camera's position in the world: x, y, z in units of the scene.
 */
data class PinholeCamera(val intrinsics: Intrinsics, val rotation: List<Double>, val centre: List<Double>) {
    init {
        require(rotation.size == 9) { "The rotation has ${rotation.size} numbers; it needs 9." }
        require(centre.size == 3) { "The centre has ${centre.size} numbers; it needs 3." }
    }

    internal fun native() = maq_pinhole_camera().also(::writeTo)

    internal fun writeTo(native: maq_pinhole_camera) {
        intrinsics.writeTo(native.intrinsics)
        native.rotation = rotation
        native.centre = centre
    }

    internal companion object {
        fun of(native: maq_pinhole_camera) =
            PinholeCamera(Intrinsics.of(native.intrinsics), native.rotation, native.centre)
    }
}

/** Red, green and blue of a colour of `android.graphics.Color`. */
internal fun rgbOf(colour: Int?) = ByteArray(3) { ((colour ?: 0) shr (16 - 8 * it)).toByte() }

/** A point in metres. */
data class Point3(val x: Double, val y: Double, val z: Double) {
    internal companion object {
        fun of(xyz: List<Double>) = Point3(xyz[0], xyz[1], xyz[2])
    }
}
