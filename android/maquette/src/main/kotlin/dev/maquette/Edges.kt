package dev.maquette

import dev.maquette.jni.NativeEdges
import java.nio.ByteBuffer
import java.nio.ByteOrder
import java.nio.FloatBuffer

/**
 * Finds the sharp edges in frames of a depth camera. Made by [Maquette.edges].
 *
 * ```
 * edges.run(frame).use { result ->
 *     result.findCurves().use { found -> found.boxes.firstOrNull()?.let { show(it.sizeM) } }
 * }
 * ```
 */
class Edges internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, NativeEdges::destroy)

    /**
     * @property threads as of [DensePose.Config].
     * @property resultPoolSize results, and as many [EdgeCurves], that the app may hold at once.
     * @property allowSpinning as of [DensePose.Config].
     * @property skipPlanes true: the network runs only where depth is not flat within the sensor's noise. This is
     *   faster and may miss flat creases in noise.
     * @property averageFrames 2 to 64: average depth over this number of frames, to reduce noise. The camera must not
     *   move. 0: no averaging.
     */
    data class Config(
        val threads: Int = 0,
        val resultPoolSize: Int = 4,
        val allowSpinning: Boolean = false,
        val provider: DensePose.Provider = DensePose.Provider.CPU,
        val skipPlanes: Boolean = false,
        val averageFrames: Int = 0,
    ) {
        internal fun values() =
            doubleArrayOf(
                threads.toDouble(),
                resultPoolSize.toDouble(),
                if (allowSpinning) 1.0 else 0.0,
                provider.ordinal.toDouble(),
                if (skipPlanes) 1.0 else 0.0,
                averageFrames.toDouble(),
            )
    }

    /**
     * Finds the field of a depth frame, or of the depth that came with a colour frame. Takes milliseconds, so not on
     * the main thread; one call at a time. The first frame of a size takes longer.
     *
     * @param frame must have [Frame.intrinsics]; distortion is ignored.
     * @throws MaquetteException with [Status.UNSUPPORTED] (a frame without depth or intrinsics),
     *   [Status.INVALID_ARGUMENT] (intrinsics of another size), [Status.POOL_EMPTY] while [Config.resultPoolSize]
     *   results are open, and [Status.CANCELLED] after [cancel].
     */
    fun run(frame: Frame): EdgesResult =
        handle.use { edges -> frame.handle.use { EdgesResult(NativeEdges.run(edges, it)) } }

    /** Cancels the running [run], or else the next one; from any thread. */
    fun cancel() = handle.use(NativeEdges::cancel)

    override fun close() = handle.close()
}

/** For each pixel of a depth frame, how far its point is from the nearest sharp edge. */
class EdgesResult internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, NativeEdges::releaseResult)

    /** The planes of floats. */
    enum class Plane(internal val code: Int) {
        /** Distance to the nearest edge, in footprints (depth / focal length); [epsR]: no edge is nearer. */
        DISTANCE(1),

        /** Predicted mean absolute error of the distance, in footprints. */
        EXPECTED_ERROR(2),

        /** The frame's depth in metres; 0 where it is unknown. */
        DEPTH(4),
    }

    /** The kind of a pixel's nearest edge. */
    enum class Kind {
        NONE,

        /** Two surfaces meet, and both are visible. */
        CREASE,

        /** The surface ends here and hides its other side. */
        BOUNDARY,
    }

    /** Milliseconds of the stages, and counts of pixels. */
    data class Stats(
        val depthMs: Double,
        val skipMs: Double,
        val slopesMs: Double,
        val networkMs: Double,
        val decodeMs: Double,
        val totalMs: Double,
        val knownPixels: Long,
        val networkPixels: Long,
        val brokenPixels: Long,
        val provider: DensePose.Provider,
        val threads: Int,
        val isThreadsMeasured: Boolean,
        val averagedPixels: Long,
    )

    /** The largest distance, in footprints. */
    val epsR: Double

    /** Camera of the depth frame. */
    val intrinsics: Intrinsics
    val widthPx: Int get() = intrinsics.widthPx
    val heightPx: Int get() = intrinsics.heightPx

    init {
        val field = handle.use(NativeEdges::fieldOfResult)
        epsR = field[0]
        intrinsics = Intrinsics.of(field.copyOfRange(1, field.size))
    }

    /**
     * Returns a plane in native memory, [heightPx] rows of [widthPx] values, read-only and without a copy. Do not read
     * it after the result has been closed: use [copyPlane] for a copy.
     */
    fun plane(plane: Plane): FloatBuffer = bytes(plane.code, Float.SIZE_BYTES).asFloatBuffer()

    /** Copies a plane, [heightPx] rows of [widthPx] values. */
    fun copyPlane(plane: Plane): FloatArray =
        handle.use { FloatArray(widthPx * heightPx).also { values -> plane(plane).get(values) } }

    /** Copies the ordinals of [Kind], [heightPx] rows of [widthPx] values. */
    fun copyKinds(): ByteArray =
        handle.use { ByteArray(widthPx * heightPx).also { values -> bytes(KINDS, 1).get(values) } }

    private fun bytes(plane: Int, valueBytes: Int): ByteBuffer =
        handle.use { NativeEdges.planeOfResult(it, plane, valueBytes).asReadOnlyBuffer().order(ByteOrder.nativeOrder()) }

    /** Finds curves, corners and boxes. Takes some milliseconds. They outlive the result. */
    fun findCurves(config: EdgeCurves.Config = EdgeCurves.Config()): EdgeCurves =
        handle.use { EdgeCurves(NativeEdges.findCurves(it, config.values())) }

    /**
     * Writes `<path>_distance.png`, `<path>_kind.png` and `<path>_edges.json`, atomically, into a folder that exists.
     * Needs Android 11. Blocks while they are written.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (an empty path, or a folder) and [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { NativeEdges.saveResult(it, path.toByteArray()) }

    /** Times and counts of the run. */
    val stats: Stats
        get() {
            val s = handle.use(NativeEdges::statsOfResult)
            return Stats(
                s[0], s[1], s[2], s[3], s[4], s[5], s[6].toLong(), s[7].toLong(), s[8].toLong(),
                DensePose.Provider.entries[s[9].toInt()], s[10].toInt(), s[11] != 0.0,
                s[12].toLong(),
            )
        }

    override fun close() = handle.close()

    private companion object {
        const val KINDS = 3
    }
}
