package dev.maquette.jni

import java.nio.ByteBuffer

/** The C API's edges of depth frames, as [Native]. */
internal object NativeEdges {
    init {
        System.loadLibrary("maquette_jni")
    }

    @JvmStatic
    external fun create(
        context: Long,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        values: DoubleArray,
    ): Long

    @JvmStatic external fun destroy(edges: Long)
    @JvmStatic external fun run(edges: Long, frame: Long): Long
    @JvmStatic external fun cancel(edges: Long)

    @JvmStatic external fun releaseResult(result: Long)
    @JvmStatic external fun saveResult(result: Long, path: ByteArray)
    @JvmStatic external fun fieldOfResult(result: Long): DoubleArray
    @JvmStatic external fun planeOfResult(result: Long, plane: Int, valueBytes: Int): ByteBuffer
    @JvmStatic external fun statsOfResult(result: Long): DoubleArray

    @JvmStatic external fun findCurves(result: Long, values: DoubleArray): Long
    @JvmStatic external fun releaseCurves(curves: Long)
    @JvmStatic external fun countsOfCurves(curves: Long): DoubleArray
    @JvmStatic external fun curve(curves: Long, index: Int): DoubleArray
    @JvmStatic external fun corner(curves: Long, index: Int): DoubleArray
    @JvmStatic external fun box(curves: Long, index: Int): DoubleArray
    @JvmStatic external fun snap(curves: Long, xPx: Double, yPx: Double, radiusPx: Double): DoubleArray
    @JvmStatic external fun saveCurves(curves: Long, path: ByteArray)
}
