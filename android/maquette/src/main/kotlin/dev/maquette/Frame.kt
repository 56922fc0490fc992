package dev.maquette

import android.graphics.Bitmap
import android.hardware.HardwareBuffer
import dev.maquette.jni.*
import java.nio.ByteBuffer
import java.nio.ByteOrder

/** Rows from top to bottom, 8 bits a channel but for depth. */
enum class PixelFormat(internal val code: Int) {
    RGB8(MAQ_PIXEL_RGB8),
    BGR8(MAQ_PIXEL_BGR8),
    RGBA8(MAQ_PIXEL_RGBA8),
    GREY8(MAQ_PIXEL_GREY8),

    /** Planes Y, and U and V in turns at half the size; BT.601, video range. */
    NV12(MAQ_PIXEL_NV12),
    YUYV(MAQ_PIXEL_YUYV),

    /** uint16 a pixel: millimetres, 0 where nothing is known. */
    DEPTH16(MAQ_PIXEL_DEPTH16),

    /** float a pixel: metres; unknown where it is 0, negative, infinite or NaN. */
    DEPTH32F(MAQ_PIXEL_DEPTH32F),
    ;

    internal fun rows(plane: Int, heightPx: Int): Int = if (plane == 1) (heightPx + 1) / 2 else heightPx

    internal fun rowBytes(plane: Int, widthPx: Int): Long =
        when (this) {
            RGB8, BGR8 -> 3L * widthPx
            RGBA8, DEPTH32F -> 4L * widthPx
            GREY8 -> widthPx.toLong()
            NV12 -> if (plane == 0) widthPx.toLong() else (widthPx + 1L) / 2 * 2
            YUYV -> (widthPx + 1L) / 2 * 4
            DEPTH16 -> 2L * widthPx
        }

    internal companion object {
        fun of(code: Int) = entries.first { it.code == code }
    }
}

/** The zero of a timestamp. */
enum class Clock(internal val code: Int) {
    /** The start of the file. */
    MEDIA(MAQ_CLOCK_MEDIA),

    /** `System.nanoTime()`. */
    MONOTONIC(MAQ_CLOCK_MONOTONIC),
    ;

    internal companion object {
        fun of(code: Int) = entries.first { it.code == code }
    }
}

/** Rows of pixels in a direct buffer. [strideBytes]: from one row to the next, 0: rows without padding. */
class Plane(val pixels: ByteBuffer, val strideBytes: Int = 0)

/** An image with its time. Made by [Maquette]; not changed afterwards. */
class Frame internal constructor(pointer: Long, release: (Long) -> Unit = Native::maq_frame_release) : AutoCloseable {
    internal val handle = Handle(this, pointer, release)
    private val description = handle.read(maq_frame_desc(), Native::maq_frame_get_desc)

    val widthPx: Int get() = description.width_px
    val heightPx: Int get() = description.height_px
    val format: PixelFormat get() = PixelFormat.of(description.format)
    val clock: Clock get() = Clock.of(description.clock)
    val timestampNs: Long get() = description.timestamp_ns

    /** Its number in its source, from 0. */
    val sequence: Long get() = description.sequence

    /** How its camera maps directions to pixels; null if that is unknown. Frames of a calibrated [Source] have it. */
    val intrinsics: Intrinsics?
        get() {
            val native = handle.read(maq_frame_desc(), Native::maq_frame_get_desc).intrinsics
            return if (native.width_px == 0) null else Intrinsics.of(native)
        }

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
        get() {
            val o = handle.read(maq_frame_origin(), Native::maq_frame_get_origin)
            if (o.kind == MAQ_FRAME_CAPTURED) return null
            return Origin(o.horizon_ns, o.age_ns, o.captured_timestamp_ns, o.captured_sequence)
        }

    /** Copies the pixels into a direct buffer as RGB8, BGR8, RGBA8 or GREY8, rows without padding. */
    fun copyPixels(
        format: PixelFormat,
        into: ByteBuffer,
    ) = handle.use { Native.maq_frame_copy_pixels(it, format.code, Memory(into), 0, into.capacity().toLong()) }

    /** A copy as an ARGB_8888 bitmap. */
    fun toBitmap(): Bitmap = Bitmap.createBitmap(widthPx, heightPx, Bitmap.Config.ARGB_8888).also(::copyTo)

    /**
     * Copies the pixels into a bitmap of the app, of the frame's size: none is made anew.
     *
     * @throws IllegalArgumentException for a bitmap that is not mutable, or not ARGB_8888.
     */
    fun copyTo(bitmap: Bitmap) {
        requireDrawable(bitmap)
        handle.use { Android.copyFrame(it, bitmap, true) }
    }

    /**
     * Copies the pixels into a hardware buffer of the app, of the frame's size, as RGBA_8888 or RGBX_8888.
     *
     * @param buffer made with [HardwareBuffer.USAGE_CPU_WRITE_OFTEN] or [HardwareBuffer.USAGE_CPU_WRITE_RARELY].
     */
    fun copyTo(buffer: HardwareBuffer) {
        requireOpen(buffer)
        handle.use { Android.copyFrame(it, buffer, false) }
    }

    /** A copy in another size, as BGR8. */
    fun resize(
        widthPx: Int,
        heightPx: Int,
    ): Frame = handle.use { Frame(Native.maq_frame_resize(it, widthPx, heightPx)) }

    /**
     * A copy of the frame's depth: of its own pixels, or of the depth image that came with the picture; null if it has
     * none.
     */
    fun copyDepth(): DepthImage? =
        orNull(Status.UNSUPPORTED) {
            handle.use { frame ->
                val depth = maq_frame_desc().also { Native.maq_frame_get_depth(frame, it) }
                DepthImage(depth.width_px, depth.height_px, metresOf(depth))
            }
        }

    /**
     * Writes the picture to a file in the format of its extension, PNG (.png) or JPEG (.jpg), atomically, in a folder
     * that exists. Needs Android 11: before, use [toBitmap] and `Bitmap.compress`. Blocks while it is written.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension), [Status.UNSUPPORTED] (a depth
     *   image, an older Android) and [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { Native.maq_frame_save(it, textOf(path)) }

    override fun close() = handle.close()
}

/** [heightPx] rows of [widthPx] depths along the optical axis, in metres; 0 where it is unknown. */
class DepthImage(val widthPx: Int, val heightPx: Int, val metres: FloatArray)

/** The C API cannot see how long a buffer is. */
internal fun requireRows(plane: Plane, rows: Int, rowBytes: Long) {
    if (rows < 1 || rowBytes < 0) return // the C API says so
    val stride = if (plane.strideBytes == 0) rowBytes else plane.strideBytes.toLong()
    val needed = (rows - 1) * stride + rowBytes
    if (stride >= 0 && needed <= plane.pixels.capacity()) return
    val problem = "A plane needs $needed bytes, but its buffer has ${plane.pixels.capacity()}."
    throw MaquetteException(Status.INVALID_ARGUMENT, problem)
}

private fun metresOf(depth: maq_frame_desc): FloatArray {
    val stride = depth.stride_bytes[0].toInt()
    val rows = depth.planes[0].bytes(stride.toLong() * depth.height_px)
    return FloatArray(depth.width_px * depth.height_px) { k ->
        val (row, column) = k / depth.width_px to k % depth.width_px
        if (depth.format == MAQ_PIXEL_DEPTH32F) {
            rows.getFloat(row * stride + 4 * column).takeIf { it.isFinite() && it > 0 } ?: 0f
        } else {
            val millimetres = rows.getShort(row * stride + 2 * column).toInt() and 0xFFFF
            if (millimetres == 0xFFFF) 0f else millimetres * 0.001f
        }
    }
}

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
