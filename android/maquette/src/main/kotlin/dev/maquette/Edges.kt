package dev.maquette

import dev.maquette.jni.*
import java.nio.ByteBuffer
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
    private val handle = Handle(this, pointer, Native::maq_edges_destroy)

    /**
     * @property threads as of [DensePose.Config].
     * @property resultPoolSize results, and as many [EdgeCurves], that the app may hold at once.
     * @property skipPlanes true: the network runs only where depth is not flat within the sensor's noise. This is
     *   faster and may miss flat creases in noise.
     * @property averageFrames 2 to 64: average depth over this number of frames, to reduce noise. The camera must not
     *   move. 0: no averaging.
     */
    data class Config(
        val threads: Int = 0,
        val resultPoolSize: Int = 4,
        val provider: DensePose.Provider = DensePose.Provider.CPU,
        val skipPlanes: Boolean = false,
        val averageFrames: Int = 0,
    ) {
        internal fun native(bundle: ModelBundle) =
            maq_edges_config().also {
                it.model.set(bundle, threads, provider)
                it.result_pool_size = resultPoolSize
                it.skip_planes = skipPlanes.toInt()
                it.average_frames = averageFrames
            }
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
        handle.use { edges -> frame.handle.use { EdgesResult(Native.maq_edges_run(edges, it)) } }

    /** Cancels the running [run], or else the next one; from any thread. */
    fun cancel() = handle.use(Native::maq_edges_cancel)

    override fun close() = handle.close()
}

/** For each pixel of a depth frame, how far its point is from the nearest sharp edge. */
class EdgesResult internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, Native::maq_edges_result_release)

    /** The planes of floats. */
    enum class Plane(internal val code: Int) {
        /** Distance to the nearest edge, in footprints (depth / focal length); [epsR]: no edge is nearer. */
        DISTANCE(MAQ_EDGES_PLANE_DISTANCE),

        /** Predicted mean absolute error of the distance, in footprints. */
        EXPECTED_ERROR(MAQ_EDGES_PLANE_EXPECTED_ERROR),

        /** The frame's depth in metres; 0 where it is unknown. */
        DEPTH(MAQ_EDGES_PLANE_DEPTH),
    }

    /** The kind of a pixel's nearest edge. */
    enum class Kind(internal val code: Int) {
        NONE(MAQ_EDGES_KIND_NONE),

        /** Two surfaces meet, and both are visible. */
        CREASE(MAQ_EDGES_KIND_CREASE),

        /** The surface ends here and hides its other side. */
        BOUNDARY(MAQ_EDGES_KIND_BOUNDARY),
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
        /** Pixels beyond 50 m; more than half of the known ones: the unit of the depth is probably wrong. */
        val farPixels: Long,
    )

    /** The largest distance, in footprints. */
    val epsR: Double

    /** Camera of the depth frame. */
    val intrinsics: Intrinsics
    val widthPx: Int get() = intrinsics.widthPx
    val heightPx: Int get() = intrinsics.heightPx

    init {
        val field = handle.read(maq_edges_field(), Native::maq_edges_result_get_field)
        epsR = field.eps_r.toDouble()
        intrinsics = Intrinsics.of(field.intrinsics)
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
        handle.use { ByteArray(widthPx * heightPx).also { values -> bytes(MAQ_EDGES_PLANE_KIND, 1).get(values) } }

    private fun bytes(plane: Int, valueBytes: Int): ByteBuffer =
        handle.use {
            planeOf(widthPx * valueBytes, heightPx) { values, stride ->
                Native.maq_edges_result_get_plane(it, plane, values, stride)
            }
        }

    /** Finds curves, corners and boxes. Takes some milliseconds. They outlive the result. */
    fun findCurves(config: EdgeCurves.Config = EdgeCurves.Config()): EdgeCurves =
        handle.use { EdgeCurves(Native.maq_edges_result_find_curves(it, config.native())) }

    /**
     * Writes `<path>_distance.png`, `<path>_kind.png` and `<path>_edges.json`, atomically, into a folder that exists.
     * Needs Android 11. Blocks while they are written.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (an empty path, or a folder) and [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { Native.maq_edges_result_save(it, textOf(path)) }

    /** Times and counts of the run. */
    val stats: Stats
        get() {
            val s = handle.read(maq_edges_stats(), Native::maq_edges_result_get_stats)
            return Stats(
                s.depth_ms, s.skip_ms, s.slopes_ms, s.network_ms, s.decode_ms, s.total_ms, s.known_pixel_count,
                s.network_pixel_count, s.broken_pixel_count, DensePose.Provider.of(s.provider), s.threads,
                s.is_threads_measured != 0, s.averaged_pixel_count, s.far_pixel_count,
            )
        }

    override fun close() = handle.close()
}
