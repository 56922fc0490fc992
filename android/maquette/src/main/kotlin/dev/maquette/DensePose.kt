package dev.maquette

import android.graphics.Bitmap
import android.hardware.HardwareBuffer
import dev.maquette.jni.*
import java.nio.ByteBuffer

/** Finds people and maps each of their pixels to the body surface. Made by [Maquette.densePose]. */
class DensePose internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, Native::maq_densepose_destroy)

    /** The values that are computed for each pixel of a person. */
    enum class Detail(internal val code: Int) {
        /** Part, U and V. */
        SURFACE(MAQ_DENSEPOSE_DETAIL_SURFACE),

        /** Only the part: faster. */
        PART(MAQ_DENSEPOSE_DETAIL_PART),
    }

    /** The library or hardware that runs the layers of networks. */
    enum class Provider(internal val code: Int) {
        /** ONNX Runtime's own kernels. */
        CPU(MAQ_PROVIDER_CPU),

        /** Kernels of XNNPACK, for networks of floats, on the CPU. */
        XNNPACK(MAQ_PROVIDER_XNNPACK),

        /** Accelerators of the device; may be slower than the CPU: measure it. */
        NNAPI(MAQ_PROVIDER_NNAPI),
        ;

        internal companion object {
            fun of(code: Int) = entries.first { it.code == code }
        }
    }

    /** The use that the other defaults are for. */
    enum class Preset(internal val code: Int) {
        /** Frames of a camera or clip: fast. */
        STREAM(MAQ_DENSEPOSE_PRESET_STREAM),

        /** Single images: everybody is mapped again in a crop of 256 pixels, which takes two to three times as long. */
        PHOTO(MAQ_DENSEPOSE_PRESET_PHOTO),
    }

    /** Chooses the people whose surface is computed again from an upright crop of the frame in full resolution. */
    enum class PersonCrops(internal val code: Int) {
        /** The preset's: off for streams, all for photos. */
        DEFAULT(MAQ_DENSEPOSE_CROPS_DEFAULT),
        OFF(MAQ_DENSEPOSE_CROPS_OFF),

        /** Crops of people who are small in the networks' input, or lean. */
        AUTO(MAQ_DENSEPOSE_CROPS_AUTO),
        ALL(MAQ_DENSEPOSE_CROPS_ALL),
    }

    /**
     * Zeros stand for the bundle's values.
     *
     * @property threads 0: the large cores, at most 4; [THREADS_MEASURED]: as many of these as pay, measured while the
     *   networks are made, which takes up to about half a second longer. [DensePoseResult.Stats.threads] tells.
     * @property longSidePx the long side of the networks' input. 0: automatic: the bundle's value, and 480 pixels as
     *   well where people are small or nobody is found.
     * @property scoreThreshold minimum score of a person.
     * @property resultPoolSize results that the app may hold at once, 1 to 64; 0: 4.
     * @property keyFrameInterval 0 and 1: people are detected in each frame; N: in every N-th frame of a stream.
     * @property hasKeypoints whether [Person.keypoints] are found.
     * @property steadiness in a stream: how much the frames before count for parts, U and V, up to 0.95; 0: 0.9; -1: not
     *   at all.
     * @property minPersonHeightPx people less tall than this in the frame may be missed.
     * @property provider networks for which it cannot be had, or of which it takes less than half, run on the CPU;
     *   [DensePoseResult.Stats.provider] tells. The shipped int8 networks gain nothing from XNNPACK.
     */
    data class Config(
        val threads: Int = 0,
        val longSidePx: Int = 0,
        val scoreThreshold: Float = 0f,
        val maxPeople: Int = 0,
        val resultPoolSize: Int = 0,
        val maxProposals: Int = 0,
        val keyFrameInterval: Int = 0,
        val minPersonHeightPx: Int = 0,
        val detail: Detail = Detail.SURFACE,
        val personCrops: PersonCrops = PersonCrops.DEFAULT,
        val personCropPx: Int = 0,
        val provider: Provider = Provider.CPU,
        val preset: Preset = Preset.STREAM,
        val hasKeypoints: Boolean = false,
        val steadiness: Float = 0f,
    ) {
        internal fun native(bundle: ModelBundle) =
            maq_densepose_config().also {
                it.preset = preset.code
                it.model.set(bundle, threads, provider)
                it.long_side_px = longSidePx
                it.score_threshold = scoreThreshold
                it.max_people = maxPeople
                it.result_pool_size = resultPoolSize
                it.max_proposals = maxProposals
                it.key_frame_interval = keyFrameInterval
                it.min_person_height_px = minPersonHeightPx
                it.detail = detail.code
                it.person_crops = personCrops.code
                it.person_crop_px = personCropPx
                it.has_keypoints = if (hasKeypoints) 1 else 0
                it.steadiness = steadiness
            }
    }

    /**
     * Finds the people of a frame. Takes milliseconds, so not on the main thread; one call at a time.
     *
     * @throws MaquetteException with [Status.POOL_EMPTY] while [Config.resultPoolSize] results are open, and with
     *   [Status.CANCELLED] after [cancel].
     */
    fun run(frame: Frame): DensePoseResult =
        handle.use { densePose -> frame.handle.use { DensePoseResult(Native.maq_densepose_run(densePose, it)) } }

    /** Ends the [run] that runs, or else the next; from any thread. */
    fun cancel() = handle.use(Native::maq_densepose_cancel)

    /**
     * The next frames show the world rotated clockwise by [rollRad] radians (-7 to 7), as of a phone that is held
     * askew: the networks see them rotated upright. From any thread. By the gravity sensor (`Sensor.TYPE_GRAVITY`) it is
     * `atan2(x, y)`, of x to the right and y up in the frame's picture; of a front camera `atan2(-x, y)`.
     */
    fun setRoll(rollRad: Float) = handle.use { Native.maq_densepose_set_roll(it, rollRad) }

    /** The next frame begins another stream: a key frame. */
    fun reset() = handle.use(Native::maq_densepose_reset)

    /**
     * The body that parts, U and V refer to; null if the bundle has none. Blocks briefly the first time.
     *
     * @throws MaquetteException with [Status.BAD_BUNDLE] if it is damaged.
     */
    fun surface(): BodySurface? = handle.use { native -> BodySurface.of { Native.maq_densepose_get_surface(native, it) } }

    override fun close() = handle.close()

    companion object {
        /** For [Config.threads]. */
        const val THREADS_MEASURED = MAQ_THREADS_MEASURED

        /** The name of a body part, 1 to 24; "background" for 0. */
        fun partName(part: Int): String = textAt(Native.maq_densepose_get_part_name(part))

        /** The colour that the part is painted with in Maquette's pictures, opaque ARGB; transparent for 0. */
        fun partColour(part: Int): Int {
            if (part !in 1..24) return 0
            val rgb = Memory(3).also { Native.maq_densepose_get_part_colour(part, it) }.bytes(0, 3)
            return rgb.fold(0xFF) { colour, channel -> colour shl 8 or (channel.toInt() and 0xFF) }
        }
    }
}

/**
 * A place on a person, in pixels of the frame; low confidence (0 to 1) if the frame does not show it.
 *
 * @property name as in MediaPipe Pose: "left_wrist". "Left" is the person's left.
 */
data class Keypoint(
    val name: String,
    val x: Float,
    val y: Float,
    val confidence: Float,
)

/**
 * Edges in pixels of the frame, the right and the bottom one exclusive; score 0 to 1.
 *
 * @property id from 1; in a stream the same for one person while seen.
 * @property keypoints the 33 keypoints of MediaPipe Pose, in its order; empty without [DensePose.Config.hasKeypoints].
 */
data class Person(
    val left: Float,
    val top: Float,
    val right: Float,
    val bottom: Float,
    val score: Float,
    val id: Long,
    val keypoints: List<Keypoint> = emptyList(),
)

/** The people of a frame, best score first, and a byte for each pixel of the frame in four planes. */
class DensePoseResult internal constructor(pointer: Long, release: (Long) -> Unit = Native::maq_densepose_result_release) :
    AutoCloseable {
    internal val handle = Handle(this, pointer, release)

    /** The values of each pixel, one plane for each. */
    enum class Plane(internal val code: Int) {
        /** Body part 1 to 24, 0 for background. */
        PART(MAQ_DENSEPOSE_PLANE_PART),

        /** U * 255. */
        U(MAQ_DENSEPOSE_PLANE_U),

        /** V * 255. */
        V(MAQ_DENSEPOSE_PLANE_V),

        /** Index of the person in [people] plus 1, 0 for background. */
        PERSON(MAQ_DENSEPOSE_PLANE_PERSON),
    }

    /** Milliseconds of the stages, and counts. */
    data class Stats(
        val preprocessMs: Double,
        val trunkMs: Double,
        val proposalsMs: Double,
        val boxHeadMs: Double,
        val denseHeadMs: Double,
        val cropsMs: Double,
        val decodeMs: Double,
        val keypointsMs: Double,
        val totalMs: Double,
        val networkWidthPx: Int,
        val networkHeightPx: Int,
        val proposals: Int,
        val people: Int,
        val crops: Int,
        val droppedBoxes: Int,
        val bodyPixels: Long,
        val clampedPixels: Long,
        val isKeyFrame: Boolean,
        val provider: DensePose.Provider,
        val threads: Int,
        val isThreadsMeasured: Boolean,
    )

    val widthPx: Int
    val heightPx: Int
    val people: List<Person>

    init {
        val (width, height) = handle.use { pairOf { width, height -> Native.maq_densepose_result_get_size(it, width, height) } }
        widthPx = width
        heightPx = height
        people =
            List(handle.use(Native::maq_densepose_result_get_person_count)) { index ->
                val person =
                    handle.read(maq_densepose_person()) { it, person ->
                        Native.maq_densepose_result_get_person(it, index, person)
                    }
                val (left, top, right, bottom) = person.box_px
                Person(left, top, right, bottom, person.score, person.id, keypointsOf(index))
            }
    }

    private fun keypointsOf(person: Int): List<Keypoint> {
        val values = Memory(3 * MAQ_DENSEPOSE_KEYPOINT_COUNT * Float.SIZE_BYTES)
        orNull(Status.NOT_FOUND) {
            handle.use { Native.maq_densepose_result_get_keypoints(it, person, values) }
        } ?: return emptyList()
        val flat = values.floats(0, 3 * MAQ_DENSEPOSE_KEYPOINT_COUNT)
        return List(MAQ_DENSEPOSE_KEYPOINT_COUNT) {
            val name = textAt(Native.maq_densepose_get_keypoint_name(it))
            Keypoint(name, flat[3 * it], flat[3 * it + 1], flat[3 * it + 2])
        }
    }

    /**
     * Where the head of a person is, by the pixels that show it: for [HeadBuilder.addPhoto]. null where none of it is seen.
     *
     * @param person index in [people].
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for another index.
     */
    fun headBox(person: Int): HeadBox? =
        orNull(Status.NOT_FOUND) {
            val box = Memory(4 * Float.SIZE_BYTES)
            handle.use { Native.maq_densepose_result_get_head_box(it, person, box) }
            val (left, top, right, bottom) = box.floats(0, 4)
            HeadBox(left, top, right, bottom)
        }

    /**
     * Finds the pixel of a person that shows a point of the body surface; null where no pixel shows the part. The other
     * direction is in the planes.
     *
     * @param person index in [people].
     * @param part 1 to 24.
     * @param u 0 to 1, as [v].
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for values out of their ranges.
     */
    fun findPixel(person: Int, part: Int, u: Float, v: Float): SurfacePixel? =
        orNull(Status.NOT_FOUND) {
            val found = Memory(2 * Float.SIZE_BYTES)
            val distance = Memory(Float.SIZE_BYTES)
            handle.use { Native.maq_densepose_result_find_pixel(it, person, part, u, v, found, distance) }
            SurfacePixel(found.float(0), found.float(4), distance.float(0))
        }

    /**
     * A plane as it lies in native memory, [heightPx] rows of [widthPx] bytes, read-only and without a copy. It must
     * not be read after the result has been closed: [copyPlane] gives what stays.
     */
    fun plane(plane: Plane): ByteBuffer =
        handle.use {
            planeOf(widthPx, heightPx) { pixels, stride ->
                Native.maq_densepose_result_get_plane(it, plane.code, pixels, stride)
            }
        }

    /** Copies a plane, [heightPx] rows of [widthPx] bytes. */
    fun copyPlane(plane: Plane): ByteArray =
        handle.use { ByteArray(widthPx * heightPx).also { values -> plane(plane).get(values) } }

    /**
     * A picture of the frame's size to draw over it: each pixel of a person in the colour of its part
     * ([DensePose.partColour]), the background transparent. It stays when the result is closed.
     *
     * @param opacity of the colours, 0 (invisible) to 255 (they cover the frame).
     * @throws IllegalArgumentException for another opacity.
     */
    fun overlay(opacity: Int = 180): Bitmap =
        Bitmap.createBitmap(widthPx, heightPx, Bitmap.Config.ARGB_8888).also { draw(it, null, opacity) }

    /**
     * Draws into a bitmap of the app, of the frame's size, in place of its pixels: none is made anew.
     *
     * @param frame the one that the result is of, to be drawn below the people; null: as [overlay].
     * @param opacity as of [overlay].
     * @throws IllegalArgumentException for a bitmap that is not mutable, or not ARGB_8888, and for another opacity.
     */
    fun draw(onto: Bitmap, frame: Frame? = null, opacity: Int = 180) {
        requireDrawable(onto)
        draw(onto, true, frame, opacity)
    }

    /**
     * Draws into a hardware buffer of the app, of the frame's size, as RGBA_8888 or RGBX_8888.
     *
     * @param onto made with [HardwareBuffer.USAGE_CPU_WRITE_OFTEN] or [HardwareBuffer.USAGE_CPU_WRITE_RARELY].
     */
    fun draw(onto: HardwareBuffer, frame: Frame? = null, opacity: Int = 180) {
        requireOpen(onto)
        draw(onto, false, frame, opacity)
    }

    private fun draw(onto: Any, isBitmap: Boolean, frame: Frame?, opacity: Int) {
        require(opacity in 0..255) { "The opacity is $opacity; it must be 0 to 255." }
        val draw = { below: Long -> handle.use { Android.drawResult(it, below, opacity, onto, isBitmap) } }
        if (frame == null) draw(0) else frame.handle.use(draw)
    }

    /**
     * Writes three files in the DensePose convention: `<path>_IUV.png` (I, U and V as blue, green and red),
     * `<path>_INDS.png` ([Plane.PERSON]) and `<path>.json` (size, boxes, scores). The folder of [path] exists; each
     * file is written atomically. Needs Android 11. Blocks while the files are written.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (a path that ends with "/"), [Status.UNSUPPORTED] (an
     *   older Android) and [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { Native.maq_densepose_result_save(it, textOf(path)) }

    /** Times and counts of the run that gave the result. */
    val stats: Stats
        get() {
            val s = handle.read(maq_densepose_stats(), Native::maq_densepose_result_get_stats)
            return Stats(
                s.preprocess_ms, s.trunk_ms, s.proposals_ms, s.box_head_ms, s.dense_head_ms, s.crops_ms, s.decode_ms,
                s.keypoints_ms, s.total_ms, s.network_width_px, s.network_height_px, s.proposal_count, s.person_count, s.crop_count,
                s.dropped_box_count, s.body_pixel_count, s.clamped_pixel_count, s.is_key_frame != 0,
                DensePose.Provider.of(s.provider), s.threads, s.is_threads_measured != 0,
            )
        }

    override fun close() = handle.close()
}
