package dev.maquette

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

    internal fun values(): DoubleArray =
        doubleArrayOf(widthPx.toDouble(), heightPx.toDouble(), fxPx, fyPx, cxPx, cyPx) + distortion

    internal companion object {
        fun of(v: DoubleArray) =
            Intrinsics(v[0].toInt(), v[1].toInt(), v[2], v[3], v[4], v[5], v.slice(6 until 14))
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

    internal fun values(): DoubleArray = intrinsics.values() + rotation + centre

    internal companion object {
        fun of(v: DoubleArray) = PinholeCamera(Intrinsics.of(v), v.slice(14 until 23), v.slice(23 until 26))
    }
}

/** A point in metres. */
data class Point3(val x: Double, val y: Double, val z: Double)
