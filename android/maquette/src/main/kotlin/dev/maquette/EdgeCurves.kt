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
     * How curves are found; lengths in pixels and footprints, so that the defaults suit any camera and scene.
     *
     * @property selectPx pixels nearer than that to an edge say where it is.
     * @property minVotes how many an edge needs: 1 is what all pixels on one side of it have together.
     * @property smearPx so near an edge depth may be of neither surface.
     * @property supportPx surfaces beside an edge are fitted to a band so wide, and three times as wide where depth is noisy.
     * @property breakDegrees a curve that turns by more at one place is two.
     * @property minLengthPx shorter curves are left out.
     * @property toleranceR the simplest type is taken that is so near the edge.
     * @property gapR surfaces farther apart along the ray do not meet in a crease.
     * @property joinPx ends so near the place where their curves meet share a corner.
     * @property maxCurves more are left out.
     * @property findBoxes whether boxes are looked for, too.
     */
    data class Config(
        val selectPx: Float = 4f,
        val minVotes: Float = 0.35f,
        val smearPx: Float = 3f,
        val supportPx: Float = 8f,
        val breakDegrees: Float = 15f,
        val minLengthPx: Float = 10f,
        val toleranceR: Float = 0.5f,
        val gapR: Float = 2.5f,
        val joinPx: Float = 12f,
        val maxCurves: Int = 1024,
        val findBoxes: Boolean = true,
    ) {
        internal fun values() =
            doubleArrayOf(
                selectPx.toDouble(),
                minVotes.toDouble(),
                smearPx.toDouble(),
                supportPx.toDouble(),
                breakDegrees.toDouble(),
                minLengthPx.toDouble(),
                toleranceR.toDouble(),
                gapR.toDouble(),
                joinPx.toDouble(),
                maxCurves.toDouble(),
                if (findBoxes) 1.0 else 0.0,
            )
    }

    enum class Type {
        LINE,

        /** Of a circle, or a whole one. */
        ARC,

        /** A cubic B-spline. */
        SPLINE,
    }

    /** Of a crease, seen from the camera's side. */
    enum class Bend {
        UNKNOWN,

        /** As of a box. */
        CONVEX,

        /** As between a wall and the floor. */
        CONCAVE,
    }

    /**
     * @property points the polyline that is drawn of it; of a line its two ends.
     * @property startCorner index in [corners]; -1: it ends freely.
     * @property endCorner as [startCorner].
     * @property rmsR how far, in footprints, the places are that it was fitted to.
     */
    data class Curve(
        val type: Type,
        val kind: EdgesResult.Kind,
        val bend: Bend,
        val isClosed: Boolean,
        val startCorner: Int,
        val endCorner: Int,
        val lengthM: Double,
        val rmsR: Double,
        val points: List<Point3>,
    )

    /** @property curveCount how many curves end in it. */
    data class Corner(val point: Point3, val curveCount: Int)

    /**
     * @property cornersSeen of its eight.
     * @property sizeM its sides, the longest first.
     * @property plusMinusM of each side two standard deviations.
     * @property axes the direction of each side, of length 1.
     */
    data class Box(
        val cornersSeen: Int,
        val sizeM: List<Double>,
        val plusMinusM: List<Double>,
        val axes: List<Point3>,
        val centre: Point3,
    )

    /** What a pointer can snap to. */
    enum class Target { NOTHING, CORNER, CURVE, PLANE }

    /**
     * What is at a pixel.
     *
     * @property index of the corner or the curve; of a plane, of a curve that it is beside.
     * @property point of the target.
     * @property distancePx how far it is from the pixel in the picture; 0 on a plane.
     */
    data class Snap(val target: Target, val index: Int, val point: Point3, val distancePx: Double)

    val curves: List<Curve>
    val corners: List<Corner>

    /** The largest first. */
    val boxes: List<Box>

    /** How long curves and boxes took to find, milliseconds. */
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
     * The nearest corner within the radius of a pixel of the depth frame, or else the nearest curve, or else the plane
     * beside a curve that the pixel's depth lies on.
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
            Type.entries[c[0].toInt()], EdgesResult.Kind.entries[c[1].toInt()], Bend.entries[c[2].toInt()], c[3] != 0.0,
            c[4].toInt(), c[5].toInt(), c[6], c[7], List((c.size - 8) / 3) { pointAt(c, 8 + 3 * it) },
        )

    private fun boxOf(b: DoubleArray) =
        Box(b[0].toInt(), b.slice(1..3), b.slice(4..6), List(3) { pointAt(b, 7 + 3 * it) }, pointAt(b, 16))

    private fun pointAt(v: DoubleArray, index: Int) = Point3(v[index], v[index + 1], v[index + 2])
}
