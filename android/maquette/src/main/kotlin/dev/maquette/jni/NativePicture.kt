package dev.maquette.jni

import android.graphics.Bitmap
import android.hardware.HardwareBuffer

/** Pictures of Android's own classes, as [Native]. `onto` is a Bitmap (`isBitmap`) or a HardwareBuffer. */
internal object NativePicture {
    init {
        System.loadLibrary("maquette_jni")
    }

    @JvmStatic external fun copyFrame(frame: Long, onto: Any, isBitmap: Boolean)

    /** [frame] 0: the people alone. */
    @JvmStatic external fun drawResult(result: Long, frame: Long, opacity: Int, onto: Any, isBitmap: Boolean)

    @JvmStatic external fun frameOfBitmap(context: Long, bitmap: Bitmap, timestampNs: Long): Long

    @JvmStatic
    external fun frameOfBuffer(
        context: Long,
        buffer: HardwareBuffer,
        isFullRange: Boolean,
        rotationDegrees: Int,
        timestampNs: Long,
        clock: Int,
        sequence: Long,
    ): Long
}
