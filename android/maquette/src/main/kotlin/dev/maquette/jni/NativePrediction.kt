package dev.maquette.jni

import dev.maquette.Source
import java.nio.ByteBuffer

/** Prediction, novelty and concealment of the C API, like [Native]. */
internal object NativePrediction {
    init {
        System.loadLibrary("maquette_jni")
    }

    /** Without [folder] and [names]: a method without networks, or the installed bundle. */
    @JvmStatic
    external fun createPredictor(
        context: Long,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        values: DoubleArray,
        seed: Long,
    ): Long

    @JvmStatic external fun destroyPredictor(predictor: Long)
    @JvmStatic external fun pushToPredictor(predictor: Long, frame: Long)
    @JvmStatic external fun predict(predictor: Long, aheadS: Double): Long
    @JvmStatic external fun sample(predictor: Long, sampleCount: Int, frameCount: Int, stepS: Double)
    @JvmStatic external fun cancelPredictor(predictor: Long)
    @JvmStatic external fun acquireSample(predictor: Long, sampleIndex: Int, frameIndex: Int): Long
    @JvmStatic external fun entropyMap(predictor: Long, sampleIndex: Int, frameIndex: Int): FloatArray
    @JvmStatic external fun resetPredictor(predictor: Long)
    @JvmStatic external fun statsOfPredictor(predictor: Long): DoubleArray

    /** [sharedWith]: another stream, and no bundle is read; or 0. */
    @JvmStatic
    external fun createNovelty(
        context: Long,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        values: DoubleArray,
        sharedWith: Long,
    ): Long

    @JvmStatic external fun destroyNovelty(novelty: Long)

    /** Columns, rows, bits, ratio, is event, is cut, is stream start; then the map. */
    @JvmStatic external fun pushToNovelty(novelty: Long, frame: Long): FloatArray
    @JvmStatic external fun reconstruction(novelty: Long): Long
    @JvmStatic external fun resetNovelty(novelty: Long)
    @JvmStatic external fun statsOfNovelty(novelty: Long): DoubleArray

    /** [source]: the handle of [kept], which native code keeps until the concealer is destroyed. */
    @JvmStatic external fun createConcealer(context: Long, source: Long, kept: Source, values: DoubleArray): Long
    @JvmStatic external fun destroyConcealer(concealer: Long)
    @JvmStatic external fun stopConcealer(concealer: Long)

    /** 0 after the source's last frame and after a stop. */
    @JvmStatic external fun acquireFromConcealer(concealer: Long, timeoutNs: Long): Long
    @JvmStatic external fun statsOfConcealer(concealer: Long): DoubleArray
}
