package dev.maquette.jni

import dev.maquette.Changes
import dev.maquette.Pipeline
import java.nio.ByteBuffer

/** The C API's pipelines, as [Native]. */
internal object NativePipeline {
    init {
        System.loadLibrary("maquette_jni")
    }

    @JvmStatic
    external fun create(
        context: Long,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        densePoseValues: DoubleArray,
        sourceValues: DoubleArray,
        resultPoolSize: Int,
        nice: Int,
        frameBudgetMs: Double,
        changes: Changes<Pipeline.Change>,
    ): Long

    @JvmStatic external fun destroy(pipeline: Long)
    @JvmStatic external fun setSource(pipeline: Long, uri: ByteArray)

    @JvmStatic
    external fun setDensePose(
        pipeline: Long,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        values: DoubleArray,
    )

    @JvmStatic external fun setRoll(pipeline: Long, rollRad: Float)
    @JvmStatic external fun setPaused(pipeline: Long, isPaused: Boolean)
    @JvmStatic external fun setRecording(pipeline: Long, path: ByteArray?)
    @JvmStatic external fun stop(pipeline: Long)

    /** Writes frame, dense pose and number, and three times; false after the last frame and after a stop. */
    @JvmStatic external fun acquire(pipeline: Long, timeoutNs: Long, objects: LongArray, timesMs: DoubleArray): Boolean

    /** Writes state and status; returns the problem and the source's URI. */
    @JvmStatic external fun info(pipeline: Long, codes: IntArray): Array<ByteArray>
    @JvmStatic external fun stats(pipeline: Long): DoubleArray
    @JvmStatic external fun surface(pipeline: Long): FloatArray?
}
