package dev.maquette.jni

import dev.maquette.Source
import java.nio.ByteBuffer

/** The C API's prediction, surprise and concealing, as [Native]. */
internal object NativePrediction {
    init {
        System.loadLibrary("maquette_jni")
    }

    @JvmStatic external fun createPredictor(context: Long, values: DoubleArray): Long

    /** [values] without those of a sampling: it draws nothing. */
    @JvmStatic
    external fun createNetworkPredictor(
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
    @JvmStatic external fun draw(predictor: Long, samples: Int, frames: Int, stepS: Double)
    @JvmStatic external fun drawn(predictor: Long, sample: Int, number: Int): Long
    @JvmStatic external fun uncertainty(predictor: Long, sample: Int, number: Int): FloatArray
    @JvmStatic external fun resetPredictor(predictor: Long)
    @JvmStatic external fun statsOfPredictor(predictor: Long): DoubleArray

    /** [networksOf]: another stream, and no bundle is read; or 0. */
    @JvmStatic
    external fun createSurprise(
        context: Long,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        values: DoubleArray,
        networksOf: Long,
    ): Long

    @JvmStatic external fun destroySurprise(surprise: Long)

    /** Columns, rows, bits and ratio, whether it is an event, a cut and a start; then the map. */
    @JvmStatic external fun pushToSurprise(surprise: Long, frame: Long): FloatArray
    @JvmStatic external fun rebuilt(surprise: Long): Long
    @JvmStatic external fun resetSurprise(surprise: Long)
    @JvmStatic external fun statsOfSurprise(surprise: Long): DoubleArray

    /** [source]: the handle of [kept], which native code keeps until the concealer is destroyed. */
    @JvmStatic external fun createConcealer(context: Long, source: Long, kept: Source, values: DoubleArray): Long
    @JvmStatic external fun destroyConcealer(concealer: Long)
    @JvmStatic external fun stopConcealer(concealer: Long)

    /** 0 after the source's last frame and after a stop. */
    @JvmStatic external fun acquireFromConcealer(concealer: Long, timeoutNs: Long): Long
    @JvmStatic external fun statsOfConcealer(concealer: Long): DoubleArray
}
