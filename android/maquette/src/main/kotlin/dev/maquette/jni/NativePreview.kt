package dev.maquette.jni

import android.view.Surface

/** Results on a Surface, as [Native]. */
internal object NativePreview {
    init {
        System.loadLibrary("maquette_jni")
    }

    @JvmStatic external fun create(): Long
    @JvmStatic external fun destroy(preview: Long)

    /** null: there is none any longer. Waits for a drawing that runs. */
    @JvmStatic external fun setSurface(preview: Long, surface: Surface?, widthPx: Int, heightPx: Int)

    /** False where there is no surface, or it takes no picture now. */
    @JvmStatic
    external fun draw(
        preview: Long,
        frame: Long,
        result: Long,
        fills: Boolean,
        opacity: Int,
        isMirrored: Boolean,
    ): Boolean
}
