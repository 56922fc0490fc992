package dev.maquette.jni

import dev.maquette.Changes
import dev.maquette.Source

/** The C API's sources and recorders, as [Native]. */
internal object NativeSource {
    init {
        System.loadLibrary("maquette_jni")
    }

    @JvmStatic
    external fun create(context: Long, uri: ByteArray, values: DoubleArray, changes: Changes<Source.Change>): Long

    @JvmStatic external fun destroy(source: Long)
    @JvmStatic external fun stop(source: Long)

    /** 0 after the last frame and after a stop. */
    @JvmStatic external fun acquire(source: Long, timeoutNs: Long): Long
    @JvmStatic external fun seek(source: Long, timeNs: Long)
    @JvmStatic external fun info(source: Long): DoubleArray
    @JvmStatic external fun intrinsics(source: Long): DoubleArray?
    @JvmStatic external fun control(source: Long, control: Int): DoubleArray?
    @JvmStatic external fun setControl(source: Long, control: Int, value: Double)

    @JvmStatic
    external fun createRecorder(
        context: Long,
        path: ByteArray,
        source: Long,
        jpegQuality: Int,
        keepPredicted: Boolean,
    ): Long

    @JvmStatic external fun destroyRecorder(recorder: Long)
    @JvmStatic external fun record(recorder: Long, frame: Long)
    @JvmStatic external fun finishRecorder(recorder: Long)
    @JvmStatic external fun recorderInfo(recorder: Long): DoubleArray

    @JvmStatic external fun schemeCount(): Int
    @JvmStatic external fun scheme(index: Int): Array<ByteArray>

    @JvmStatic external fun createCameraList(context: Long): Long
    @JvmStatic external fun destroyCameraList(list: Long)
    @JvmStatic external fun cameraCount(list: Long): Int
    @JvmStatic external fun cameraTexts(list: Long, index: Int): Array<ByteArray>
    @JvmStatic external fun cameraNumbers(list: Long, index: Int): DoubleArray
}
