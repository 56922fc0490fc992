package dev.maquette

import android.graphics.Bitmap
import android.hardware.HardwareBuffer
import dev.maquette.jni.Native
import dev.maquette.jni.NativePicture
import java.nio.ByteBuffer

/** Finds people and maps each of their pixels to the body surface. Made by [Maquette.densePose]. */
class DensePose internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, Native::destroyDensePose)

    /** What is computed for each pixel of a person. */
    enum class Detail {
        /** Part, U and V. */
        SURFACE,

        /** Only the part: faster. */
        PART,
    }

    /** What runs the layers of networks. */
    enum class Provider {
        /** ONNX Runtime's own kernels. */
        CPU,

        /** Those of XNNPACK, for networks of floats, on the CPU. */
        XNNPACK,

        /** Accelerators of the device; may be slower than the CPU: measure it. */
        NNAPI,
    }

    /** Whose surface is computed again from a crop of the frame in its full resolution, rotated upright. */
    enum class PersonCrops {
        OFF,

        /** Of people who are small in the networks' input, or lean. */
        AUTO,
        ALL,
    }

    /**
     * Zeros stand for the bundle's values.
     *
     * @property threads 0: the large cores, at most 4; [THREADS_MEASURED]: as many of these as pay, measured while the
     *   networks are made, which takes up to about half a second longer. [DensePoseResult.Stats.threads] tells.
     * @property scoreThreshold minimum score of a person.
     * @property resultPoolSize results that the app may hold at once, 1 to 64; 0: 4.
     * @property keyFrameInterval 0 and 1: people are detected in each frame; N: in every N-th frame of a stream.
     * @property minPersonHeightPx people less tall than this in the frame may be missed.
     * @property allowSpinning true: idle threads spin for a while, which is faster; false: they sleep, which saves
     *   energy.
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
        val allowSpinning: Boolean = false,
        val personCrops: PersonCrops = PersonCrops.OFF,
        val personCropPx: Int = 0,
        val provider: Provider = Provider.CPU,
    ) {
        internal fun values() =
            doubleArrayOf(
                threads.toDouble(),
                longSidePx.toDouble(),
                scoreThreshold.toDouble(),
                maxPeople.toDouble(),
                resultPoolSize.toDouble(),
                maxProposals.toDouble(),
                keyFrameInterval.toDouble(),
                minPersonHeightPx.toDouble(),
                detail.ordinal.toDouble(),
                if (allowSpinning) 1.0 else 0.0,
                personCrops.ordinal.toDouble(),
                personCropPx.toDouble(),
                provider.ordinal.toDouble(),
            )
    }

    /**
     * Finds the people of a frame. Takes milliseconds, so not on the main thread; one call at a time.
     *
     * @throws MaquetteException with [Status.POOL_EMPTY] while [Config.resultPoolSize] results are open, and with
     *   [Status.CANCELLED] after [cancel].
     */
    fun run(frame: Frame): DensePoseResult =
        handle.use { densePose -> frame.handle.use { DensePoseResult(Native.runDensePose(densePose, it)) } }

    /** Ends the [run] that runs, or else the next; from any thread. */
    fun cancel() = handle.use(Native::cancelDensePose)

    /**
     * The next frames show the world rotated clockwise by [rollRad] radians (-7 to 7), as of a phone that is held
     * askew: the networks see them rotated upright. From any thread. By the gravity sensor (`Sensor.TYPE_GRAVITY`) it is
     * `atan2(x, y)`, of x to the right and y up in the frame's picture; of a front camera `atan2(-x, y)`.
     */
    fun setRoll(rollRad: Float) = handle.use { Native.setRollOfDensePose(it, rollRad) }

    /** The next frame begins another stream: a key frame. */
    fun reset() = handle.use(Native::resetDensePose)

    /**
     * The body that parts, U and V refer to; null if the bundle has none. Blocks briefly the first time.
     *
     * @throws MaquetteException with [Status.BAD_BUNDLE] if it is damaged.
     */
    fun surface(): BodySurface? = handle.use(Native::surfaceOfDensePose)?.let(::BodySurface)

    override fun close() = handle.close()

    companion object {
        /** For [Config.threads]. */
        const val THREADS_MEASURED = -1

        /** The name of a body part, 1 to 24; "background" for 0. */
        fun partName(part: Int): String = Native.partName(part)

        /** The colour that the part is painted with in Maquette's pictures, opaque ARGB; transparent for 0. */
        fun partColour(part: Int): Int = if (part in 1..24) Native.partColour(part) or (0xFF shl 24) else 0
    }
}

/** Edges in pixels of the frame, the right and the bottom one exclusive; score 0 to 1. */
data class Person(val left: Float, val top: Float, val right: Float, val bottom: Float, val score: Float)

/** The people of a frame, best score first, and a byte for each pixel of the frame in four planes. */
class DensePoseResult internal constructor(pointer: Long, release: (Long) -> Unit = Native::releaseResult) :
    AutoCloseable {
    internal val handle = Handle(this, pointer, release)

    /** What is known of each pixel. */
    enum class Plane {
        /** Body part 1 to 24, 0 for background. */
        PART,

        /** U * 255. */
        U,

        /** V * 255. */
        V,

        /** Index of the person in [people] plus 1, 0 for background. */
        PERSON,
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
        val (width, height) = handle.use(Native::sizeOfResult)
        widthPx = width
        heightPx = height
        people = handle.use(Native::peopleOfResult).toList().chunked(5)
            .map { (left, top, right, bottom, score) -> Person(left, top, right, bottom, score) }
    }

    /**
     * Where the head of a person is, by the pixels that show it: for [HeadBuilder.addPhoto]. null where none of it is seen.
     *
     * @param person index in [people].
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for another index.
     */
    fun headBox(person: Int): HeadBox? =
        handle.use { Native.headBoxOfResult(it, person) }
            ?.let { (left, top, right, bottom) -> HeadBox(left, top, right, bottom) }

    /**
     * A plane as it lies in native memory, [heightPx] rows of [widthPx] bytes, read-only and without a copy. It must
     * not be read after the result has been closed: [copyPlane] gives what stays.
     */
    fun plane(plane: Plane): ByteBuffer =
        handle.use { Native.planeOfResult(it, plane.ordinal + 1).asReadOnlyBuffer() }

    /** Copies a plane, [heightPx] rows of [widthPx] bytes. */
    fun copyPlane(plane: Plane): ByteArray =
        handle.use { result ->
            ByteArray(widthPx * heightPx).also { Native.planeOfResult(result, plane.ordinal + 1).get(it) }
        }

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
        val draw = { below: Long -> handle.use { NativePicture.drawResult(it, below, opacity, onto, isBitmap) } }
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
    fun save(path: String) = handle.use { Native.saveResult(it, path.toByteArray()) }

    /** Of the run that gave the result. */
    val stats: Stats
        get() {
            val s = handle.use(Native::statsOfResult)
            val counts = s.drop(8).map(Double::toLong)
            val (width, height, proposals, found, crops) = counts.map(Long::toInt)
            return Stats(
                s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], width, height, proposals, found, crops,
                counts[5].toInt(), counts[6], counts[7], counts[8] != 0L,
                DensePose.Provider.entries[counts[9].toInt()], counts[10].toInt(), counts[11] != 0L,
            )
        }

    override fun close() = handle.close()
}
