package dev.maquette

import dev.maquette.jni.*

/**
 * The sharp feature curves of a depth frame, the corners in which they meet, and boxes. Found by
 * [EdgesResult.findCurves]; lists are copies and stay when this is closed. Points are in the camera's coordinates: x right,
 * y down, z along the optical axis.
 */
class EdgeCurves internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, Native::maq_edges_curves_release)

    /**
     * Settings of the curve search. The defaults suit all cameras and scenes, because lengths are in pixels.
     *
     * @property minLengthPx shorter curves are dropped.
     * @property skipBoxes true: do not search for boxes.
     * @property focalTolerance two standard deviations of the focal lengths, as a fraction; 0: unknown.
     */
    data class Config(
        val minLengthPx: Float = 10f,
        val skipBoxes: Boolean = false,
        val focalTolerance: Float = 0f,
    ) {
        internal fun native() =
            maq_edges_curves_config().also {
                it.min_length_px = minLengthPx
                it.skip_boxes = skipBoxes.toInt()
                it.focal_tolerance = focalTolerance
            }
    }

    enum class Type(internal val code: Int) {
        LINE(MAQ_EDGES_CURVE_LINE),

        /** A circular arc or a whole circle. */
        ARC(MAQ_EDGES_CURVE_ARC),

        /** A cubic B-spline. */
        SPLINE(MAQ_EDGES_CURVE_SPLINE),
    }

    /** The convexity of a crease, seen from the camera's side. */
    enum class Convexity(internal val code: Int) {
        UNKNOWN(MAQ_EDGES_CONVEXITY_UNKNOWN),

        /** Like the edge of a box. */
        CONVEX(MAQ_EDGES_CONVEXITY_CONVEX),

        /** Like the edge between a wall and the floor. */
        CONCAVE(MAQ_EDGES_CONVEXITY_CONCAVE),
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
     * @property includesFocalTolerance whether [sizeToleranceM] includes [Config.focalTolerance].
     */
    data class Box(
        val cornersSeen: Int,
        val sizeM: List<Double>,
        val sizeToleranceM: List<Double>,
        val axes: List<Point3>,
        val centre: Point3,
        val includesFocalTolerance: Boolean,
    )

    /** The kinds of targets that a pointer can snap to. */
    enum class Target(internal val code: Int) {
        NOTHING(MAQ_EDGES_SNAP_NOTHING),
        CORNER(MAQ_EDGES_SNAP_CORNER),
        CURVE(MAQ_EDGES_SNAP_CURVE),
        PLANE(MAQ_EDGES_SNAP_PLANE),
    }

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
        curves = List(handle.use(Native::maq_edges_curves_get_curve_count), ::curveAt)
        corners = List(handle.use(Native::maq_edges_curves_get_corner_count), ::cornerAt)
        boxes = List(handle.use(Native::maq_edges_curves_get_box_count), ::boxAt)
        val stats = handle.read(maq_edges_curves_stats(), Native::maq_edges_curves_get_stats)
        curvesMs = stats.curves_ms
        boxesMs = stats.boxes_ms
    }

    /**
     * Finds the nearest corner within the radius of a pixel of the depth frame, or else the nearest curve, or else the
     * adjacent plane on which the pixel's depth lies.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for a radius that is not 0 to 1e6.
     */
    fun snap(xPx: Double, yPx: Double, radiusPx: Double = 8.0): Snap {
        val s = maq_edges_snap()
        handle.use { Native.maq_edges_curves_snap_to_pixel(it, xPx, yPx, radiusPx, s) }
        return Snap(Target.entries.first { it.code == s.target }, s.index, Point3.of(s.point_m), s.distance_px)
    }

    /**
     * Writes the curves to a file by its extension: .json, .obj, .ply, .dxf or .step; atomically. Blocks while it is
     * written.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension) and [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { Native.maq_edges_curves_save(it, textOf(path)) }

    override fun close() = handle.close()

    private fun curveAt(index: Int): Curve {
        val c = handle.read(maq_edges_curve()) { it, curve -> Native.maq_edges_curves_get_curve(it, index, curve) }
        return Curve(
            Type.entries.first { it.code == c.type },
            EdgesResult.Kind.entries.first { it.code == c.kind },
            Convexity.entries.first { it.code == c.convexity },
            c.is_closed != 0, c.corners[0], c.corners[1], c.length_m, c.rms_footprints,
            c.points_m.doubles(3 * c.point_count).toList().chunked(3, Point3::of),
        )
    }

    private fun cornerAt(index: Int): Corner {
        val c = handle.read(maq_edges_corner()) { it, corner -> Native.maq_edges_curves_get_corner(it, index, corner) }
        return Corner(Point3.of(c.point_m), c.curve_count)
    }

    private fun boxAt(index: Int): Box {
        val b = handle.read(maq_edges_box()) { it, box -> Native.maq_edges_curves_get_box(it, index, box) }
        val axes = b.axes.chunked(3, Point3::of)
        val includesFocal = b.includes_focal_tolerance != 0
        return Box(b.corner_count, b.size_m, b.size_tolerance_m, axes, Point3.of(b.centre_m), includesFocal)
    }
}
