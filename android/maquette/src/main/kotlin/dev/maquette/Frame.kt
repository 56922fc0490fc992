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
class Frame internal constructor(pointer: Long) : AutoCloseable {
    internal val handle = Handle(this, pointer, Native::releaseFrame)
    private val description = handle.use(Native::describeFrame)

    val widthPx: Int get() = description[0].toInt()
    val heightPx: Int get() = description[1].toInt()
    val format: PixelFormat get() = PixelFormat.of(description[2].toInt())
    val clock: Clock get() = Clock.of(description[3].toInt())
    val timestampNs: Long get() = description[4]

    /** Its number in its source, from 0. */
    val sequence: Long get() = description[5]

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
