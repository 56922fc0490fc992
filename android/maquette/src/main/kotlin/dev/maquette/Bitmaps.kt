package dev.maquette

import android.graphics.Bitmap
import android.hardware.HardwareBuffer
import java.nio.ByteBuffer

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
