package dev.maquette

import android.graphics.Bitmap
import java.nio.ByteBuffer

/**
 * The library. Everything else is made by it, and may outlive it.
 *
 * ```
 * Maquette().use { maquette ->
 *     maquette.densePose(ModelBundle.ofAssets(assets, "densepose-b-int8")).use { densePose ->
 *         maquette.frame(bitmap).use { frame ->
 *             densePose.run(frame).use { result -> show(result.people) }
 *         }
 *     }
 * }
 * ```
 *
 * All objects can be closed in any order, twice, and from any thread, also while another thread is in a call. An object
 * that is used after it was closed throws [IllegalStateException]; a call that fails throws [MaquetteException].
 *
 * @param logLevel messages above it are not logged; they go to logcat under the tag `maquette`.
 * @param onnxRuntime path of the ONNX Runtime library, null: the one that came with Maquette.
 */
class Maquette(logLevel: LogLevel = LogLevel.WARNING, onnxRuntime: String? = null) : AutoCloseable {
    private val handle =
        Handle(this, Native.createContext(logLevel.ordinal, onnxRuntime?.toByteArray()), Native::destroyContext)

    /** The version of the ONNX Runtime library in use. The first call opens it. */
    val onnxRuntimeVersion: String get() = handle.use(Native::onnxRuntimeVersion)

    /** A copy of a bitmap as a frame. Its configuration must be ARGB_8888. */
    fun frame(bitmap: Bitmap, timestampNs: Long = 0): Frame {
        require(bitmap.config == Bitmap.Config.ARGB_8888) { "The bitmap is ${bitmap.config}; ARGB_8888 is needed." }
        val pixels = ByteBuffer.allocateDirect(bitmap.rowBytes * bitmap.height)
        bitmap.copyPixelsToBuffer(pixels)
        val plane = Plane(pixels, bitmap.rowBytes)
        return frame(PixelFormat.RGBA8, bitmap.width, bitmap.height, plane, timestampNs = timestampNs)
    }

    /**
     * A frame around pixels of the app, without a copy. The buffers must be direct, and their pixels must not change
     * until the frame has been closed; the frame keeps the buffers.
     *
     * @param second U and V of [PixelFormat.NV12].
     */
    fun frame(
        format: PixelFormat,
        widthPx: Int,
        heightPx: Int,
        first: Plane,
        second: Plane? = null,
        timestampNs: Long = 0,
        clock: Clock = Clock.MEDIA,
        sequence: Long = 0,
    ): Frame =
        handle.use { context ->
            Frame(
                Native.wrapFrame(
                    context,
                    format.code,
                    widthPx,
                    heightPx,
                    first.pixels,
                    first.strideBytes,
                    second?.pixels,
                    second?.strideBytes ?: 0,
                    timestampNs,
                    clock.code,
                    sequence,
                ),
            )
        }

    /** Decodes a JPEG, PNG, WebP, BMP or TIFF file, upright by its EXIF orientation. */
    fun decode(file: ByteArray): Frame {
        val data = ByteBuffer.allocateDirect(maxOf(file.size, 1))
        data.put(file)
        return handle.use { Frame(Native.decodeFrame(it, data, file.size)) }
    }

    /** Loads the networks of dense pose; takes some 100 ms, so not on the main thread. */
    fun densePose(bundle: ModelBundle, config: DensePose.Config = DensePose.Config()): DensePose =
        handle.use { context -> DensePose(bundle.create(context, config)) }

    override fun close() = handle.close()

    companion object {
        /** The version of the native library. */
        val version: String get() = Native.version()
    }
}

enum class LogLevel { OFF, ERROR, WARNING, INFO, DEBUG }
