package dev.maquette

import dev.maquette.jni.*
import java.nio.ByteBuffer
import java.nio.ByteOrder

/**
 * How scenes are built. Lengths are in units of the scene. 0 means the default.
 *
 * @property threads 0: the large cores, at most 4.
 * @property longSidePx larger photos are scaled down to this long side; 0: 640; [LONG_SIDE_FULL]: never.
 * @property coefficientBits of each number of a descriptor: 8, 16, or 32 (floats, then also positions); 0: 8.
 * @property minVariation points whose descriptors vary less between photos are stored without view dependence; RMS, for
 *   colours of 0 to 1. 0: 0.05, or with 8 bits the value at which half of the points are view-dependent, if that is
 *   larger. [VARIATION_ALL]: all points are view-dependent.
 * @property visibilityScale fraction of a photo's resolution at which visibility is tested, 1/16 to 1; 0: 1. A smaller
 *   fraction lets each point hide more of what is behind it; use it for sparse clouds.
 * @property nearDepth a camera does not see points nearer than this along its axis.
 * @property maxPoints larger clouds are thinned out evenly; 0: no limit.
 * @property maxMemoryBytes memory for the descriptors; 0: 2 GiB.
 * @property maxViews for captures: of more photos an even selection is used; 0: no limit.
 * @property useHeldOut for captures: also use photos that the capture holds out for comparison.
 */
data class SceneBuildConfig(
    val threads: Int = 0,
    val longSidePx: Int = 0,
    val coefficientBits: Int = 0,
    val minVariation: Double = 0.0,
    val visibilityScale: Double = 0.0,
    val nearDepth: Double = 0.0,
    val maxPoints: Long = 0,
    val maxMemoryBytes: Long = 0,
    val maxViews: Int = 0,
    val useHeldOut: Boolean = false,
) {
    internal fun native(bundle: ModelBundle): maq_scene_build_config {
        if (maxPoints < 0 || maxMemoryBytes < 0) {
            throw MaquetteException(Status.INVALID_ARGUMENT, "A size or a count is negative.")
        }
        return maq_scene_build_config().also {
            it.model.set(bundle, threads)
            it.long_side_px = longSidePx
            it.coefficient_bits = coefficientBits
            it.min_variation = minVariation
            it.visibility_scale = visibilityScale
            it.near_depth = nearDepth
            it.max_points = maxPoints
            it.max_memory_bytes = maxMemoryBytes
            it.max_views = maxViews
            it.use_held_out = useHeldOut.toInt()
            it.progress_callback = Addresses.ofProgressCallback()
        }
    }

    companion object {
        /** For [longSidePx]: photos are not scaled. */
        const val LONG_SIDE_FULL = MAQ_SCENE_LONG_SIDE_FULL

        /** For [minVariation]: all points are view-dependent. */
        const val VARIATION_ALL = MAQ_SCENE_VARIATION_ALL.toDouble()
    }
}

/**
 * Counts and times of building. Milliseconds are wall-clock, over all photos so far.
 *
 * @property views photos that saw points.
 * @property unusedViews photos that saw none; of a capture also those that are missing, damaged or too large.
 * @property cloudPoints after [SceneBuildConfig.maxPoints].
 * @property seenPoints points that a photo has seen.
 */
data class SceneBuildStats(
    val views: Int,
    val unusedViews: Int,
    val cloudPoints: Long,
    val seenPoints: Long,
    val loadMs: Double,
    val visibilityMs: Double,
    val alignMs: Double,
    val extractMs: Double,
    val accumulateMs: Double,
    val solveMs: Double,
    val packMs: Double,
) {
    internal companion object {
        fun of(s: maq_scene_build_stats) =
            SceneBuildStats(
                s.view_count, s.unused_view_count, s.cloud_point_count, s.seen_point_count, s.load_ms, s.visibility_ms,
                s.align_ms, s.extract_ms, s.accumulate_ms, s.solve_ms, s.pack_ms,
            )
    }
}

/**
 * A point cloud of the app. It is copied by [Maquette.sceneBuilder].
 *
 * @property xyz a direct buffer of floats in native byte order, from its start: x, y, z of each point, relative to
 *   [origin], in units of the scene.
 * @property pointCount 1 to 30 million; 12 bytes each.
 * @property origin x, y, z in the world; near the cloud, since floats have 7 digits.
 * @property up of the world; any length but 0.
 */
class PointCloud(
    val xyz: ByteBuffer,
    val pointCount: Long,
    val origin: List<Double> = listOf(0.0, 0.0, 0.0),
    val up: List<Double>,
) {
    init {
        require(origin.size == 3 && up.size == 3) {
            "Origin and up of a cloud have ${origin.size} and ${up.size} numbers; each needs 3."
        }
    }

    internal fun native(): maq_point_cloud {
        val memory = Memory(xyz)
        if (pointCount !in 0..memory.sizeBytes / POINT_BYTES) {
            val problem =
                "A cloud needs $POINT_BYTES bytes for each of its $pointCount points, but its buffer has " +
                    "${memory.sizeBytes} bytes."
            throw MaquetteException(Status.INVALID_ARGUMENT, problem)
        }
        return maq_point_cloud().also {
            it.point_count = pointCount
            it.xyz.set(memory)
            it.origin = origin
            it.up = up
        }
    }

    companion object {
        private const val POINT_BYTES = 3 * Float.SIZE_BYTES

        /** A cloud from an array of x, y, z of each point. */
        fun of(xyz: FloatArray, origin: List<Double> = listOf(0.0, 0.0, 0.0), up: List<Double>): PointCloud {
            require(xyz.size % 3 == 0) { "The cloud has ${xyz.size} coordinates; each point needs 3." }
            val buffer = ByteBuffer.allocateDirect(maxOf(4 * xyz.size, 1)).order(ByteOrder.nativeOrder())
            buffer.asFloatBuffer().put(xyz)
            return PointCloud(buffer, xyz.size / 3L, origin, up)
        }
    }
}

/**
 * Builds a scene from a cloud and photos of the app. Made by [Maquette.sceneBuilder]. Functions may be called from any
 * thread, one at a time but for [cancel]; they take long, so not on the main thread.
 */
class SceneBuilder internal constructor(
    context: Long,
    cloud: PointCloud,
    bundle: ModelBundle,
    config: SceneBuildConfig,
) : AutoCloseable {
    private val handle =
        Handle(
            this,
            Native.maq_scene_builder_create(context, config.native(bundle), cloud.native()),
            Native::maq_scene_builder_destroy,
        )

    /** As it is now. */
    val stats: SceneBuildStats get() = 
        SceneBuildStats.of(handle.read(maq_scene_build_stats(), Native::maq_scene_builder_get_stats))

    /**
     * Adds a photo of any format but depth, which may be closed afterwards. When it fails or is cancelled, the builder
     * stays as it was.
     *
     * @param camera of the photo, in its size.
     * @param progress may cancel; what it throws cancels too, and is thrown. It must not use this builder.
     * @return how many points the photo saw, possibly 0.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (an invalid camera, or one of another size than the
     *   photo), [Status.CANCELLED], [Status.IMAGE_SIZE], [Status.UNSUPPORTED], [Status.OUT_OF_MEMORY].
     */
    fun addView(photo: Frame, camera: PinholeCamera, progress: Progress? = null): Long =
        handle.use { builder ->
            photo.handle.use { frame ->
                val seen = Memory(Long.SIZE_BYTES)
                Callbacks.during(progress) {
                    Native.maq_scene_builder_add_view(builder, frame, camera.native(), seen)
                }
                seen.long(0)
            }
        }

    /** Cancels the [addView] that runs, or else the next; from any thread. Does not block. */
    fun cancel() = handle.use(Native::maq_scene_builder_cancel)

    /**
     * Builds a scene from the photos so far; more can be added afterwards, for another scene.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] if no photo saw a point, [Status.OUT_OF_MEMORY].
     */
    fun finish(): Scene = Scene.of(handle.use(Native::maq_scene_builder_finish))

    /** Scenes that it finished stay valid. */
    override fun close() = handle.close()
}
