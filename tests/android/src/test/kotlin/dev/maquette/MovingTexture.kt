package dev.maquette

import java.nio.ByteBuffer
import kotlin.math.cos
import kotlin.math.sin

/** Frames of a smooth texture that moves to the right, 160 x 120. */
object MovingTexture {
    const val WIDTH_PX = 160
    const val HEIGHT_PX = 120
    const val STEP_PX = 4
    const val PERIOD_NS = 100_000_000L

    /** The brightness of each pixel, after the texture has moved so far. */
    fun greys(shiftPx: Int): ByteArray =
        ByteArray(WIDTH_PX * HEIGHT_PX) { k ->
            val x = (k % WIDTH_PX - shiftPx).toDouble()
            val y = (k / WIDTH_PX).toDouble()
            val grey = 128 + 40 * sin(x / 7 + y / 11) + 40 * sin(x / 5 - y / 9 + 1) + 30 * cos(x / 13)
            grey.coerceIn(0.0, 255.0).toInt().toByte()
        }

    /** The frame of that number, or another picture in its place. */
    fun frame(maquette: Maquette, number: Int, greys: ByteArray = greys(STEP_PX * number)): Frame {
        val rgb = ByteBuffer.allocateDirect(3 * greys.size)
        for (grey in greys) rgb.put(grey).put(grey).put(grey)
        return maquette.frame(
            PixelFormat.RGB8,
            WIDTH_PX,
            HEIGHT_PX,
            Plane(rgb),
            timestampNs = number * PERIOD_NS,
            sequence = number.toLong(),
        )
    }

    /** The brightness of a frame's pixels. */
    fun greysOf(frame: Frame): ByteArray {
        val pixels = ByteBuffer.allocateDirect(frame.widthPx * frame.heightPx)
        frame.copyPixels(PixelFormat.GREY8, pixels)
        return ByteArray(pixels.capacity()).also { pixels.rewind().get(it) }
    }
}
