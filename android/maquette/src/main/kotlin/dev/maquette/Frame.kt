package dev.maquette

import android.graphics.Bitmap
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
    fun toBitmap(): Bitmap {
        val pixels = ByteBuffer.allocateDirect(4 * widthPx * heightPx)
        copyPixels(PixelFormat.RGBA8, pixels)
        return Bitmap.createBitmap(widthPx, heightPx, Bitmap.Config.ARGB_8888).apply { copyPixelsFromBuffer(pixels) }
    }

    /** A copy in another size, as BGR8. */
    fun resize(
        widthPx: Int,
        heightPx: Int,
    ): Frame = handle.use { Frame(Native.resizeFrame(it, widthPx, heightPx)) }

    override fun close() = handle.close()
}
