package dev.maquette.jni

import dev.maquette.NativeProgress
import java.nio.ByteBuffer

/** The C API's captures and scenes, as [Native]. */
internal object NativeScene {
    init {
        System.loadLibrary("maquette_jni")
    }

    @JvmStatic external fun openCapture(context: Long, folder: ByteArray): Long
    @JvmStatic external fun closeCapture(capture: Long)
    @JvmStatic external fun captureInfo(capture: Long): DoubleArray
    @JvmStatic external fun viewNumbers(capture: Long, index: Int): DoubleArray
    @JvmStatic external fun viewName(capture: Long, index: Int): ByteArray
    @JvmStatic external fun drop(capture: Long, index: Int, count: LongArray): ByteArray
    @JvmStatic external fun loadView(capture: Long, index: Int): Long

    @JvmStatic
    external fun build(
        context: Long,
        capture: Long,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        values: DoubleArray,
        progress: NativeProgress?,
    ): Long

    @JvmStatic
    external fun createBuilder(
        context: Long,
        xyz: ByteBuffer,
        pointCount: Long,
        originAndUp: DoubleArray,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        values: DoubleArray,
    ): Long

    @JvmStatic external fun buildStats(scene: Long): DoubleArray
    @JvmStatic external fun destroyBuilder(builder: Long)
    @JvmStatic external fun addView(builder: Long, photo: Long, camera: DoubleArray, progress: NativeProgress?): Long
    @JvmStatic external fun cancelBuilder(builder: Long)
    @JvmStatic external fun builderStats(builder: Long): DoubleArray
    @JvmStatic external fun finishBuilder(builder: Long): Long

    @JvmStatic external fun open(context: Long, path: ByteArray): Long
    @JvmStatic external fun openMemory(context: Long, file: ByteBuffer): Long
    @JvmStatic external fun close(scene: Long)
    @JvmStatic external fun save(scene: Long, path: ByteArray)
    @JvmStatic external fun savePly(scene: Long, path: ByteArray)

    /** Writes the SHA-256 of the networks. */
    @JvmStatic external fun info(scene: Long, networks: ByteArray): DoubleArray

    @JvmStatic
    external fun createRenderer(
        context: Long,
        scene: Long,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        values: DoubleArray,
    ): Long

    @JvmStatic external fun destroyRenderer(renderer: Long)
    @JvmStatic external fun render(renderer: Long, camera: DoubleArray): Long
}
