package dev.maquette.jni

import java.nio.ByteBuffer

/** The C API's rendered images, as [Native]. */
internal object NativeImage {
    init {
        System.loadLibrary("maquette_jni")
    }

    @JvmStatic external fun release(image: Long)
    @JvmStatic external fun size(image: Long): IntArray
    @JvmStatic external fun plane(image: Long, plane: Int, rowBytes: Int, heightPx: Int): ByteBuffer
    @JvmStatic external fun sceneStats(image: Long): DoubleArray
    @JvmStatic external fun save(image: Long, path: ByteArray, alpha: Int)
}
