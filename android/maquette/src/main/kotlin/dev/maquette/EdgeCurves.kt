package dev.maquette

import dev.maquette.jni.NativeEdges

/**
 * The sharp feature curves of a depth frame, the corners in which they meet, and boxes. Found by
 * [EdgesResult.findCurves]; lists are copies and stay when this is closed. Points are in the camera's coordinates: x right,
 * y down, z along the optical axis.
 */
class EdgeCurves internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, NativeEdges::releaseCurves)

    /**
     * Settings of the curve search. The defaults suit all cameras and scenes, because lengths are in pixels.
     *
     * @property voteRadiusPx pixels nearer than this to an edge vote for its position.
     * @property minVotes votes an edge needs; 1 is the sum of all votes from one side of an edge.
     * @property flyingPixelBandPx half-width of the band of mixed (flying) pixels along an edge.
     * @property fitBandPx width of the band beyond it to which surfaces are fitted; three times as wide in noise.
     * @property splitAngleDegrees a curve that turns by more than this at one point is split.
     * @property minLengthPx shorter curves are dropped.
     * @property skipBoxes true: do not search for boxes.
     */
    data class Config(
        val voteRadiusPx: Float = 4f,
        val minVotes: Float = 0.35f,
        val flyingPixelBandPx: Float = 3f,
        val fitBandPx: Float = 8f,
        val splitAngleDegrees: Float = 15f,
        val minLengthPx: Float = 10f,
        val skipBoxes: Boolean = false,
    ) {
        internal fun values() =
            doubleArrayOf(
                voteRadiusPx.toDouble(),
                minVotes.toDouble(),
                flyingPixelBandPx.toDouble(),
                fitBandPx.toDouble(),
                splitAngleDegrees.toDouble(),
                minLengthPx.toDouble(),
                if (skipBoxes) 1.0 else 0.0,
            )
    }

    enum class Type {
        LINE,

        /** A circular arc or a whole circle. */
        ARC,

        /** A cubic B-spline. */
        SPLINE,
    }

    /** The convexity of a crease, seen from the camera's side. */
    enum class Convexity {
        UNKNOWN,

        /** Like the edge of a box. */
        CONVEX,

        /** Like the edge between a wall and the floor. */
        CONCAVE,
    }

    /**
     * @property points a polyline along the curve; the two ends of a line.
     * @property startCorner index in [corners]; -1: a free end.
     * @property endCorner index in [corners]; -1: a free end.
     * @property rmsFootprints root mean square distance of the measured points from the curve, in footprints.
     */
    data class Curve(
        val type: Type,
        val kind: EdgesResult.Kind,
        val convexity: Convexity,
        val isClosed: Boolean,
        val startCorner: Int,
        val endCorner: Int,
        val lengthM: Double,
        val rmsFootprints: Double,
        val points: List<Point3>,
    )

    /** @property curveCount number of curves that end here. */
    data class Corner(val point: Point3, val curveCount: Int)

    /**
     * @property cornersSeen visible corners, at most 8.
     * @property sizeM lengths of the sides, the longest first.
     * @property sizeToleranceM two standard deviations of each length.
     * @property axes directions of the sides, length 1.
     */
    data class Box(
        val cornersSeen: Int,
        val sizeM: List<Double>,
        val sizeToleranceM: List<Double>,
        val axes: List<Point3>,
        val centre: Point3,
    )

    /** What a pointer can snap to. */
    enum class Target { NOTHING, CORNER, CURVE, PLANE }

    /**
     * The target at a pixel.
     *
     * @property index index of the corner, the curve, or the plane's curve.
     * @property point point of the target.
     * @property distancePx distance to the target in the image; 0 on a plane.
     */
    data class Snap(val target: Target, val index: Int, val point: Point3, val distancePx: Double)

    val curves: List<Curve>
    val corners: List<Corner>

    /** Sorted by volume, the largest first. */
    val boxes: List<Box>

    /** Times for finding curves and boxes, in milliseconds. */
    val curvesMs: Double
    val boxesMs: Double

    init {
        val counts = handle.use(NativeEdges::countsOfCurves)
        val (curveCount, cornerCount, boxCount) = counts.take(3).map(Double::toInt)
        curves = List(curveCount) { index -> curveOf(handle.use { NativeEdges.curve(it, index) }) }
        corners = List(cornerCount) { index ->
            val c = handle.use { NativeEdges.corner(it, index) }
            Corner(pointAt(c, 1), c[0].toInt())
        }
        boxes = List(boxCount) { index -> boxOf(handle.use { NativeEdges.box(it, index) }) }
        curvesMs = counts[3]
        boxesMs = counts[4]
    }

    /**
     * Finds the nearest corner within the radius of a pixel of the depth frame, or else the nearest curve, or else the
     * adjacent plane on which the pixel's depth lies.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for a radius that is not 0 to 1e6.
     */
    fun snap(xPx: Double, yPx: Double, radiusPx: Double = 8.0): Snap {
        val s = handle.use { NativeEdges.snap(it, xPx, yPx, radiusPx) }
        return Snap(Target.entries[s[0].toInt()], s[1].toInt(), pointAt(s, 3), s[6])
    }

    /**
     * Writes the curves to a file by its extension: .json, .obj, .ply, .dxf or .step; atomically. Blocks while it is
     * written.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension) and [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { NativeEdges.saveCurves(it, path.toByteArray()) }

    override fun close() = handle.close()

    private fun curveOf(c: DoubleArray) =
        Curve(
            Type.entries[c[0].toInt()], EdgesResult.Kind.entries[c[1].toInt()], Convexity.entries[c[2].toInt()], c[3] != 0.0,
            c[4].toInt(), c[5].toInt(), c[6], c[7], List((c.size - 8) / 3) { pointAt(c, 8 + 3 * it) },
        )

    private fun boxOf(b: DoubleArray) =
        Box(b[0].toInt(), b.slice(1..3), b.slice(4..6), List(3) { pointAt(b, 7 + 3 * it) }, pointAt(b, 16))

    private fun pointAt(v: DoubleArray, index: Int) = Point3(v[index], v[index + 1], v[index + 2])
}
