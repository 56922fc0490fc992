package dev.maquette.jni

import android.graphics.Bitmap
import android.hardware.HardwareBuffer
import android.view.Surface

/** Bitmaps, hardware buffers and surfaces (src/main/cpp/jni_android.cpp). `onto`: a Bitmap (`isBitmap`) or a HardwareBuffer. */
internal object Android {
    init {
        Native // loads the library
    }

    @JvmStatic external fun copyFrame(frame: Long, onto: Any, isBitmap: Boolean)

    /** [frame] 0: the people alone. */
    @JvmStatic external fun drawResult(result: Long, frame: Long, opacity: Int, onto: Any, isBitmap: Boolean)
    @JvmStatic external fun frameOfBitmap(context: Long, bitmap: Bitmap, timestampNs: Long): Long

    /** Takes range, rotation, time, clock and number of [like]. */
    @JvmStatic external fun frameOfBuffer(context: Long, buffer: HardwareBuffer, like: Memory): Long

    @JvmStatic external fun createPreview(): Long
    @JvmStatic external fun destroyPreview(preview: Long)

    /** [surface] null: there is none any longer. Waits for a drawing that runs. */
    @JvmStatic external fun setSurface(preview: Long, surface: Surface?, widthPx: Int, heightPx: Int)

    /** False: there is no surface, or it takes no image now. */
    @JvmStatic
    external fun drawOnSurface(
        preview: Long,
        frame: Long,
        result: Long,
        fills: Boolean,
        opacity: Int,
        isMirrored: Boolean,
    ): Boolean
}
