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
        sourceValues: DoubleArray,
        resultPoolSize: Int,
        nice: Int,
        changes: Changes<Pipeline.Change>,
    ): Long

    @JvmStatic external fun destroy(pipeline: Long)
    @JvmStatic external fun setSource(pipeline: Long, uri: ByteArray)

    /** A model of dense pose. */
    @JvmStatic
    external fun createModel(
        context: Long,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        values: DoubleArray,
    ): Long

    @JvmStatic external fun destroyModel(model: Long)
    @JvmStatic external fun setModel(pipeline: Long, model: Long)
    @JvmStatic external fun setRoll(model: Long, rollRad: Float)
    @JvmStatic external fun setFrameBudget(model: Long, budgetMs: Double)

    /** Key frame interval and long side. */
    @JvmStatic external fun quality(model: Long): IntArray
    @JvmStatic external fun setPaused(pipeline: Long, isPaused: Boolean)
    @JvmStatic external fun setRecording(pipeline: Long, path: ByteArray?)
    @JvmStatic external fun stop(pipeline: Long)

    /** Writes result, frame, dense pose and number, and three times; false after the last frame and after a stop. */
    @JvmStatic external fun acquire(pipeline: Long, timeoutNs: Long, objects: LongArray, timesMs: DoubleArray): Boolean

    /** Writes state and status; returns the problem and the source's URI. */
    @JvmStatic external fun info(pipeline: Long, codes: IntArray): Array<ByteArray>
    @JvmStatic external fun stats(pipeline: Long): DoubleArray
    @JvmStatic external fun releaseResult(result: Long)
    @JvmStatic external fun surface(model: Long): FloatArray?
}
