package dev.maquette

import android.graphics.Bitmap
import android.hardware.HardwareBuffer
import dev.maquette.jni.Native
import dev.maquette.jni.NativePicture
import java.nio.ByteBuffer

/** Rows from top to bottom, 8 bits a channel but for depth. */
enum class PixelFormat(internal val code: Int) {
    RGB8(1),
    BGR8(2),
    RGBA8(3),
    GREY8(4),

    /** Planes Y, and U and V in turns at half the size; BT.601, video range. */
    NV12(5),
    YUYV(6),

    /** uint16 a pixel: millimetres, 0 where nothing is known. */
    DEPTH16(7),

    /** float a pixel: metres; unknown where it is 0, negative, infinite or NaN. */
    DEPTH32F(8),
    ;

    internal companion object {
        fun of(code: Int) = entries.first { it.code == code }
    }
}

/** The zero of a timestamp. */
enum class Clock(internal val code: Int) {
    /** The start of the file. */
    MEDIA(1),

    /** `System.nanoTime()`. */
    MONOTONIC(2),
    ;

    internal companion object {
        fun of(code: Int) = entries.first { it.code == code }
    }
}

/** Rows of pixels in a direct buffer. [strideBytes]: from one row to the next, 0: rows without padding. */
class Plane(val pixels: ByteBuffer, val strideBytes: Int = 0)

/** An image with its time. Made by [Maquette]; not changed afterwards. */
class Frame internal constructor(pointer: Long, release: (Long) -> Unit = Native::releaseFrame) : AutoCloseable {
    internal val handle = Handle(this, pointer, release)
    private val description = handle.use(Native::describeFrame)

    val widthPx: Int get() = description[0].toInt()
    val heightPx: Int get() = description[1].toInt()
    val format: PixelFormat get() = PixelFormat.of(description[2].toInt())
    val clock: Clock get() = Clock.of(description[3].toInt())
    val timestampNs: Long get() = description[4]

    /** Its number in its source, from 0. */
    val sequence: Long get() = description[5]

    /** How its camera maps directions to pixels; null if that is unknown. Frames of a calibrated [Source] have it. */
    val intrinsics: Intrinsics? get() = handle.use(Native::intrinsicsOfFrame)?.let(Intrinsics::of)

    /**
     * The captured frame that a predicted frame was made from.
     *
     * @property horizonNs from the captured frame that it was made from to its own timestamp.
     * @property ageNs since that frame was captured: until now with [Clock.MONOTONIC], else as [horizonNs].
     * @property capturedTimestampNs of that frame.
     * @property capturedSequence of that frame.
     */
    data class Origin(
        val horizonNs: Long,
        val ageNs: Long,
        val capturedTimestampNs: Long,
        val capturedSequence: Long,
    )

    /**
     * Null where a camera took the frame, or it was read, wrapped or drawn. Otherwise it was predicted, by a [Predictor] or a
     * [Concealer]: what acts on frames, such as a robot, must not act on it. A copy by [resize] keeps it; a bitmap or
     * pixels do not say so.
     */
    val origin: Origin?
        get() = handle.use(Native::originOfFrame)?.let { o -> Origin(o[0], o[1], o[2], o[3]) }

    /** Copies the pixels into a direct buffer as RGB8, BGR8, RGBA8 or GREY8, rows without padding. */
    fun copyPixels(
        format: PixelFormat,
        into: ByteBuffer,
    ) = handle.use { Native.copyFramePixels(it, format.code, into) }

    /** A copy as an ARGB_8888 bitmap. */
    fun toBitmap(): Bitmap = Bitmap.createBitmap(widthPx, heightPx, Bitmap.Config.ARGB_8888).also(::copyTo)

    /**
     * Copies the pixels into a bitmap of the app, of the frame's size: none is made anew.
     *
     * @throws IllegalArgumentException for a bitmap that is not mutable, or not ARGB_8888.
     */
    fun copyTo(bitmap: Bitmap) {
        requireDrawable(bitmap)
        handle.use { NativePicture.copyFrame(it, bitmap, true) }
    }

    /**
     * Copies the pixels into a hardware buffer of the app, of the frame's size, as RGBA_8888 or RGBX_8888.
     *
     * @param buffer made with [HardwareBuffer.USAGE_CPU_WRITE_OFTEN] or [HardwareBuffer.USAGE_CPU_WRITE_RARELY].
     */
    fun copyTo(buffer: HardwareBuffer) {
        requireOpen(buffer)
        handle.use { NativePicture.copyFrame(it, buffer, false) }
    }

    /** A copy in another size, as BGR8. */
    fun resize(
        widthPx: Int,
        heightPx: Int,
    ): Frame = handle.use { Frame(Native.resizeFrame(it, widthPx, heightPx)) }

    /**
     * A copy of the frame's depth: of its own pixels, or of the depth image that came with the picture; null if it has
     * none.
     */
    fun copyDepth(): DepthImage? {
        val size = IntArray(2)
        val metres = handle.use { Native.depthOfFrame(it, size) } ?: return null
        return DepthImage(size[0], size[1], metres)
    }

    /**
     * Writes the picture to a file in the format of its extension, PNG (.png) or JPEG (.jpg), atomically, in a folder
     * that exists. Needs Android 11: before, use [toBitmap] and `Bitmap.compress`. Blocks while it is written.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension), [Status.UNSUPPORTED] (a depth
     *   image, an older Android) and [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { Native.saveFrame(it, path.toByteArray()) }

    override fun close() = handle.close()
}

/** [heightPx] rows of [widthPx] depths along the optical axis, in metres; 0 where it is unknown. */
class DepthImage(val widthPx: Int, val heightPx: Int, val metres: FloatArray)

internal fun requireDrawable(bitmap: Bitmap) {
    require(bitmap.isMutable) { "The bitmap is not mutable; make it with Bitmap.createBitmap or copy it." }
    require(bitmap.config == Bitmap.Config.ARGB_8888) { "The bitmap is ${bitmap.config}; ARGB_8888 is needed." }
}

internal fun requireOpen(buffer: HardwareBuffer) = check(!buffer.isClosed) { "This HardwareBuffer is closed." }

/** An ARGB_8888 bitmap of three bytes a pixel, blue, green, red, and one of alpha; null: it is opaque. */
internal fun bitmapOf(bgr: ByteBuffer, alpha: ByteBuffer?, widthPx: Int, heightPx: Int): Bitmap {
    val colours = ByteArray(3 * widthPx * heightPx)
    bgr.get(colours)
    val alphas = alpha?.let { ByteArray(widthPx * heightPx).also(it::get) }
    val pixels =
        IntArray(widthPx * heightPx) { k ->
            val blue = colours[3 * k].toInt() and 0xFF
            val green = colours[3 * k + 1].toInt() and 0xFF
            val red = colours[3 * k + 2].toInt() and 0xFF
            val opacity = if (alphas == null) 0xFF else alphas[k].toInt() and 0xFF
            opacity shl 24 or (red shl 16) or (green shl 8) or blue
        }
    return Bitmap.createBitmap(pixels, widthPx, heightPx, Bitmap.Config.ARGB_8888)
}
