package dev.maquette

import dev.maquette.jni.NativeEdges
import java.nio.ByteBuffer
import java.nio.ByteOrder
import java.nio.FloatBuffer

/**
 * Finds the sharp edges in frames of a depth camera. Made by [Maquette.edges].
 *
 * ```
 * edges.run(frame, intrinsics).use { result ->
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
     * @property skipPlanes true: the network runs only where a plane does not explain the depth within the sensor's
     *   noise: faster, and may miss flat creases in noise.
     * @property averageFrames 2 to 64: depth is the mean over so many frames of a camera at rest, which takes noise away;
     *   what moves begins anew. 0: each frame is on its own.
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
     * Finds the field of a depth frame, or of the depth that came with a picture. Takes milliseconds, so not on the
     * main thread; one call at a time. The first frame of a size takes longer.
     *
     * @param intrinsics of the depth frame, or of the picture that the depth came with; distortion is left out of
     *   account.
     * @throws MaquetteException with [Status.UNSUPPORTED] (a frame without depth), [Status.INVALID_ARGUMENT] (intrinsics
     *   of another size), [Status.POOL_EMPTY] while [Config.resultPoolSize] results are open, and [Status.CANCELLED]
     *   after [cancel].
     */
    fun run(frame: Frame, intrinsics: Intrinsics): EdgesResult =
        handle.use { edges ->
            frame.handle.use { EdgesResult(NativeEdges.run(edges, it, intrinsics.values())) }
        }

    /** Ends the [run] that runs, or else the next; from any thread. */
    fun cancel() = handle.use(NativeEdges::cancel)

    override fun close() = handle.close()
}

/** For each pixel of a depth frame, how far its point is from the nearest sharp edge. */
class EdgesResult internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, NativeEdges::releaseResult)

    /** What is known of each pixel, as floats. */
    enum class Plane(internal val code: Int) {
        /** To the nearest edge, in footprints (depth / focal length); [epsR]: none is nearer. */
        DISTANCE(1),

        /** By how many footprints the distance may be wrong. */
        SPREAD(2),

        /** The frame's depth in metres; 0 where it is unknown. */
        DEPTH(4),
    }

    /** What the nearest edge of a pixel is. */
    enum class Kind {
        NONE,

        /** Two surfaces meet in it, and both are seen. */
        CREASE,

        /** The surface ends there; its other side is hidden. */
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

    /** Where distances end, in footprints. */
    val epsR: Double

    /** Of the depth frame. */
    val intrinsics: Intrinsics
    val widthPx: Int get() = intrinsics.widthPx
    val heightPx: Int get() = intrinsics.heightPx

    init {
        val field = handle.use(NativeEdges::fieldOfResult)
        epsR = field[0]
        intrinsics = Intrinsics.of(field.copyOfRange(1, field.size))
    }

    /**
     * A plane as it lies in native memory, [heightPx] rows of [widthPx] values, read-only and without a copy. It must
     * not be read after the result has been closed: [copyPlane] gives what stays.
     */
    fun plane(plane: Plane): FloatBuffer = bytes(plane.code, Float.SIZE_BYTES).asFloatBuffer()

    /** Copies a plane, [heightPx] rows of [widthPx] values. */
    fun copyPlane(plane: Plane): FloatArray =
        handle.use { FloatArray(widthPx * heightPx).also { values -> plane(plane).get(values) } }

    /** The [Kind] of each pixel's nearest edge, as its number; as [copyPlane]. */
    fun copyKinds(): ByteArray =
        handle.use { ByteArray(widthPx * heightPx).also { values -> bytes(KINDS, 1).get(values) } }

    private fun bytes(plane: Int, valueBytes: Int): ByteBuffer =
        handle.use { NativeEdges.planeOfResult(it, plane, valueBytes).asReadOnlyBuffer().order(ByteOrder.nativeOrder()) }

    /** Finds curves, corners and boxes. Takes some milliseconds. They outlive the result. */
    fun findCurves(config: EdgeCurves.Config = EdgeCurves.Config()): EdgeCurves =
        handle.use { EdgeCurves(NativeEdges.findCurves(it, config.values())) }

    /**
     * Writes `<stem>_distance.png`, `<stem>_kind.png` and `<stem>_edges.json`, atomically, into a folder that exists.
     * Needs Android 11. Blocks while they are written.
     *
     * @throws MaquetteException as [DensePoseResult.save].
     */
    fun save(folder: String, stem: String) =
        handle.use { NativeEdges.saveResult(it, folder.toByteArray(), stem.toByteArray()) }

    /** Of the run that gave the result. */
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
