package dev.maquette

import dev.maquette.jni.*
import kotlin.math.roundToInt
import kotlin.math.sqrt

/**
 * The points of the template body, in its rest pose, that parts, U and V stand for. Made by [DensePose.surface] and
 * [Pipeline.surface].
 */
class BodySurface internal constructor(private val points: FloatArray) {
    /** Points along U, and along V, of each part. */
    val nodes: Int = sqrt(points.size / (PARTS * 3.0)).roundToInt()

    /**
     * A point of the body in metres, bilinear between nodes: x to the body's left, y to its back, z up. null where the
     * part has no such point.
     *
     * @param part 1 to 24.
     * @param u 0 to 1, as [v].
     * @throws IllegalArgumentException for another part.
     */
    fun pointAt(part: Int, u: Float, v: Float): FloatArray? {
        require(part in 1..PARTS) { "The part is $part; it must be 1 to $PARTS." }
        val last = nodes - 1
        val (atU, atV) = u.coerceIn(0f, 1f) * last to v.coerceIn(0f, 1f) * last
        val (u0, v0) = minOf(atU.toInt(), last - 1) to minOf(atV.toInt(), last - 1)
        val point = FloatArray(3)
        for (corner in 0..3) {
            val (du, dv) = corner and 1 to (corner shr 1)
            val weight = (if (du == 1) atU - u0 else u0 + 1 - atU) * (if (dv == 1) atV - v0 else v0 + 1 - atV)
            if (weight == 0f) continue
            val from = 3 * (((part - 1) * nodes + u0 + du) * nodes + v0 + dv)
            for (axis in 0..2) point[axis] += weight * points[from + axis]
        }
        return point.takeUnless { it[0].isNaN() }
    }

    /** A copy of all, [24][nodes][nodes][3]: part - 1, U, V; x, y and z, which are NaN where a part has no point. */
    fun copyPoints(): FloatArray = points.clone()

    internal companion object {
        private const val PARTS = 24

        /** null: the networks have no surface. */
        fun of(fill: (maq_densepose_surface) -> Unit): BodySurface? =
            orNull(Status.UNSUPPORTED) {
                val surface = maq_densepose_surface().also(fill)
                BodySurface(surface.points_m.floats(PARTS * 3 * surface.nodes * surface.nodes))
            }
    }
}
