package dev.maquette.sample

import dev.maquette.Intrinsics
import dev.maquette.PinholeCamera
import dev.maquette.Scene
import kotlin.math.PI
import kotlin.math.cos
import kotlin.math.sin
import kotlin.math.sqrt

/** A point or a direction of the world. */
data class Vector(val x: Double, val y: Double, val z: Double) {
    val length get() = sqrt(this dot this)

    operator fun plus(other: Vector) = Vector(x + other.x, y + other.y, z + other.z)

    operator fun minus(other: Vector) = this + other * -1.0

    operator fun times(factor: Double) = Vector(x * factor, y * factor, z * factor)

    infix fun dot(other: Vector) = x * other.x + y * other.y + z * other.z

    infix fun cross(other: Vector) =
        Vector(y * other.z - z * other.y, z * other.x - x * other.z, x * other.y - y * other.x)

    fun unit() = this * (1 / length)

    fun toList() = listOf(x, y, z)

    companion object {
        fun of(values: List<Double>) = Vector(values[0], values[1], values[2])
    }
}

/**
 * A camera that circles around a point and looks at it.
 *
 * @property up of the world, of length 1.
 * @property angle around [up], radians.
 * @property elevation above the horizon, radians.
 */
data class Orbit(
    val centre: Vector,
    val up: Vector,
    val radius: Double,
    val angle: Double = 0.0,
    val elevation: Double = 0.3,
) {
    /** Around by [across] and [up] radians, to [nearer] times the distance. */
    fun moved(across: Double = 0.0, up: Double = 0.0, nearer: Double = 1.0) = copy(
        angle = angle + across,
        elevation = (elevation + up).coerceIn(-MAX_ELEVATION, MAX_ELEVATION),
        radius = radius * nearer,
    )

    fun camera(widthPx: Int, heightPx: Int): PinholeCamera {
        // Two directions of the horizon, whichever axis is up.
        val first = (up cross if (up.x * up.x < 0.5) Vector(1.0, 0.0, 0.0) else Vector(0.0, 1.0, 0.0)).unit()
        val horizontal = first * cos(angle) + (up cross first) * sin(angle)
        val direction = horizontal * cos(elevation) + up * sin(elevation)
        val forward = direction * -1.0
        val right = (forward cross up).unit()
        val down = forward cross right
        val focal = 0.8 * widthPx
        return PinholeCamera(
            Intrinsics(widthPx, heightPx, focal, focal, 0.5 * (widthPx - 1), 0.5 * (heightPx - 1)),
            listOf(right, down, forward).flatMap(Vector::toList),
            (centre + direction * radius).toList(),
        )
    }

    companion object {
        private const val MAX_ELEVATION = 0.45 * PI

        /** From where the whole scene is seen. */
        fun around(scene: Scene.Info): Orbit {
            val min = Vector.of(scene.boundsMin)
            val max = Vector.of(scene.boundsMax)
            return Orbit((min + max) * 0.5, Vector.of(scene.up), 0.75 * (max - min).length)
        }
    }
}
