package dev.maquette.jni

import java.nio.ByteBuffer

/**
 * The C API (src/main/cpp): contexts, frames and dense pose; the other objects of this package have the rest. Handles are
 * numbers here; [dev.maquette.Handle] keeps them. Texts are UTF-8. A bundle is a folder, or names and buffers.
 * The values of a configuration are in the order of its properties.
 */
internal object Native {
    init {
        System.loadLibrary("maquette_jni")
    }

    @JvmStatic external fun version(): String
    @JvmStatic external fun partName(part: Int): String
    @JvmStatic external fun partColour(part: Int): Int

    @JvmStatic external fun createContext(logLevel: Int, onnxRuntime: ByteArray?): Long
    @JvmStatic external fun destroyContext(context: Long)
    @JvmStatic external fun onnxRuntimeVersion(context: Long): String

    @JvmStatic
    external fun wrapFrame(
        context: Long,
        format: Int,
        widthPx: Int,
        heightPx: Int,
        first: ByteBuffer,
        firstStride: Int,
        second: ByteBuffer?,
        secondStride: Int,
        timestampNs: Long,
        clock: Int,
        sequence: Long,
        intrinsics: DoubleArray?,
    ): Long

    /** Buffers of Y, U and V, and of each its row stride and pixel stride. */
    @JvmStatic
    external fun frameOfImage(
        context: Long,
        widthPx: Int,
        heightPx: Int,
        buffers: Array<ByteBuffer>,
        strides: IntArray,
        isFullRange: Boolean,
        rotationDegrees: Int,
        timestampNs: Long,
        clock: Int,
        sequence: Long,
    ): Long

    @JvmStatic external fun decodeFrame(context: Long, data: ByteBuffer, sizeBytes: Int): Long
    @JvmStatic external fun releaseFrame(frame: Long)
    @JvmStatic external fun describeFrame(frame: Long): LongArray

    /** Horizon, age, and timestamp and sequence of the captured frame; null: no predicted frame. */
    @JvmStatic external fun originOfFrame(frame: Long): LongArray?
    @JvmStatic external fun intrinsicsOfFrame(frame: Long): DoubleArray?
    @JvmStatic external fun copyFramePixels(frame: Long, format: Int, pixels: ByteBuffer)

    /** Depth in metres; writes its width and height. Null: the frame has none. */
    @JvmStatic external fun depthOfFrame(frame: Long, size: IntArray): FloatArray?
    @JvmStatic external fun saveFrame(frame: Long, path: ByteArray)
    @JvmStatic external fun resizeFrame(frame: Long, widthPx: Int, heightPx: Int): Long

    @JvmStatic
    external fun createDensePose(
        context: Long,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        values: DoubleArray,
    ): Long

    @JvmStatic external fun destroyDensePose(densePose: Long)
    @JvmStatic external fun runDensePose(densePose: Long, frame: Long): Long
    @JvmStatic external fun cancelDensePose(densePose: Long)
    @JvmStatic external fun setRollOfDensePose(densePose: Long, rollRad: Float)
    @JvmStatic external fun resetDensePose(densePose: Long)
    @JvmStatic external fun surfaceOfDensePose(densePose: Long): FloatArray?

    @JvmStatic external fun releaseResult(result: Long)
    @JvmStatic external fun saveResult(result: Long, path: ByteArray)
    @JvmStatic external fun sizeOfResult(result: Long): IntArray
    @JvmStatic external fun peopleOfResult(result: Long): FloatArray

    /** Left, top, right, bottom; null: none of the person's head is seen. */
    @JvmStatic external fun headBoxOfResult(result: Long, person: Int): FloatArray?
    @JvmStatic external fun planeOfResult(result: Long, plane: Int): ByteBuffer
    @JvmStatic external fun statsOfResult(result: Long): DoubleArray
}
