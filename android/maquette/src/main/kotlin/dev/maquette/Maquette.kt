package dev.maquette

import android.content.res.AssetManager
import android.graphics.Bitmap
import android.graphics.ImageFormat
import android.hardware.HardwareBuffer
import android.media.Image
import dev.maquette.jni.*
import java.io.IOException
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
        Handle(
            this,
            Native.maq_context_create(
                MAQ_HEADER_VERSION,
                maq_context_config().also {
                    it.log_level = logLevel.code
                    it.log_callback = Addresses.ofLogCallback()
                    it.onnxruntime_library.set(onnxRuntime?.let(::textOf))
                },
            ),
            Native::maq_context_destroy,
        )

    /** The version of the ONNX Runtime library in use. The first call opens it. */
    val onnxRuntimeVersion: String
        get() {
            val version = Memory(Long.SIZE_BYTES)
            return handle.use { context ->
                Native.maq_context_get_onnxruntime(context, version, null)
                Pointer(version).text()
            }
        }

    /** A copy of a bitmap as a frame. Its configuration must be ARGB_8888. */
    fun frame(bitmap: Bitmap, timestampNs: Long = 0): Frame {
        require(bitmap.config == Bitmap.Config.ARGB_8888) { "The bitmap is ${bitmap.config}; ARGB_8888 is needed." }
        return handle.use { Frame(Android.frameOfBitmap(it, bitmap, timestampNs)) }
    }

    /**
     * A frame around pixels of the app, without a copy. The buffers must be direct, and their pixels must not change
     * until the frame has been closed; the frame keeps the buffers.
     *
     * @param second U and V of [PixelFormat.NV12].
     * @param intrinsics of the camera, for the frame's size; [Edges.run] needs them. null: unknown.
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
        intrinsics: Intrinsics? = null,
    ): Frame =
        handle.use { context ->
            val planes = listOfNotNull(first, second.takeIf { format == PixelFormat.NV12 })
            val desc =
                maq_frame_desc().also { desc ->
                    desc.format = format.code
                    desc.width_px = widthPx
                    desc.height_px = heightPx
                    desc.timestamp_ns = timestampNs
                    desc.clock = clock.code
                    desc.sequence = sequence
                    intrinsics?.writeTo(desc.intrinsics)
                    planes.forEachIndexed { index, plane ->
                        val rowBytes = format.rowBytes(index, widthPx)
                        requireRows(plane, format.rows(index, heightPx), rowBytes)
                        desc.planes[index].set(Memory(plane.pixels))
                    }
                    desc.stride_bytes = planes.map { it.strideBytes.toLong() }
                }
            Callbacks.keep(planes) { Frame(Native.maq_frame_wrap(context, desc, Addresses.ofReleaseCallback(), it)) }
        }

    /**
     * A copy of an image of the camera or of a video decoder (YUV_420_888, with any strides) as an NV12 frame: the
     * image may be closed when the call returns. It is not mirrored, and its crop rectangle is not used.
     *
     * @param isFullRange true: brightness is 0 to 255, as of images of a camera (JFIF); false: 16 to 235, as of most
     *   videos.
     * @param clock of the image's timestamp: [Clock.MONOTONIC] for a camera, [Clock.MEDIA] for a video.
     * @param sequence its number, from 0.
     * @param rotationDegrees clockwise, from the image to the frame: 0, 90, 180 or 270.
     * @throws IllegalArgumentException for another format.
     * @throws IllegalStateException if the image is closed.
     */
    fun frame(
        image: Image,
        isFullRange: Boolean = true,
        clock: Clock = Clock.MONOTONIC,
        sequence: Long = 0,
        rotationDegrees: Int = 0,
    ): Frame {
        val format = image.format
        require(format == ImageFormat.YUV_420_888) { "The image has format $format; YUV_420_888 is needed." }
        val native = yuvImage(image.timestamp, clock, sequence, isFullRange, rotationDegrees)
        native.width_px = image.width
        native.height_px = image.height
        val planes = image.planes
        planes.zip(native.planes) { from, to -> to.set(Memory(from.buffer)) }
        native.size_bytes = planes.map { it.buffer.capacity().toLong() }
        native.stride_bytes = planes.map { it.rowStride }
        native.pixel_stride_bytes = planes.map { it.pixelStride }
        return handle.use { Frame(Native.maq_frame_convert_yuv(it, native)) }
    }

    /**
     * A frame of a hardware buffer, of a camera, a decoder or a renderer. RGBA_8888, RGBX_8888 and RGB_888 are not copied:
     * the frame keeps the buffer, which may be closed when the call returns, locked for reading until the frame is
     * closed; its pixels must not change until then. YCBCR_420_888 is copied, but for buffers that are NV12 in video range
     * already and not rotated.
     *
     * @param buffer made with [HardwareBuffer.USAGE_CPU_READ_OFTEN] or [HardwareBuffer.USAGE_CPU_READ_RARELY].
     * @param isFullRange of YCBCR_420_888, as of an [Image].
     * @param rotationDegrees of YCBCR_420_888, as of an [Image].
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (a buffer for the GPU alone), [Status.UNSUPPORTED]
     *   (protected content, another format, several layers, YCBCR_420_888 before Android 10), [Status.UNREADABLE]
     *   (Android does not lock it), [Status.IMAGE_SIZE].
     * @throws IllegalStateException if the buffer is closed.
     */
    fun frame(
        buffer: HardwareBuffer,
        timestampNs: Long = 0,
        clock: Clock = Clock.MEDIA,
        sequence: Long = 0,
        isFullRange: Boolean = true,
        rotationDegrees: Int = 0,
    ): Frame {
        requireOpen(buffer)
        val like = yuvImage(timestampNs, clock, sequence, isFullRange, rotationDegrees)
        return handle.use { Frame(Android.frameOfBuffer(it, buffer, like)) }
    }

    private fun yuvImage(
        timestampNs: Long,
        clock: Clock,
        sequence: Long,
        isFullRange: Boolean,
        rotationDegrees: Int,
    ) = maq_yuv_image().also {
        it.timestamp_ns = timestampNs
        it.clock = clock.code
        it.sequence = sequence
        it.is_video_range = (!isFullRange).toInt()
        it.rotation_deg = rotationDegrees
    }

    /**
     * Decodes a JPEG, PNG, WebP or BMP file, upright by its EXIF orientation. Needs Android 11: before, decode it with
     * `BitmapFactory` and call [frame].
     *
     * @throws MaquetteException with [Status.UNREADABLE] (damaged, or no image), [Status.UNSUPPORTED] (another format, an
     *   older Android), [Status.IMAGE_SIZE].
     */
    fun decode(file: ByteArray): Frame {
        val data = ByteBuffer.allocateDirect(maxOf(file.size, 1))
        data.put(file)
        return handle.use { Frame(Native.maq_frame_decode(it, Memory(data), file.size.toLong())) }
    }

    /** Loads the networks of dense pose; takes some 100 ms, so not on the main thread. */
    fun densePose(bundle: ModelBundle, config: DensePose.Config = DensePose.Config()): DensePose =
        handle.use { context ->
            DensePose(Native.maq_densepose_create(context, config.native(bundle)))
        }

    /**
     * An empty texture for one person.
     *
     * @param tilePx width and height of the tile of a part, 8 to 512; 0: 64.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for another size.
     */
    fun densePoseTexture(tilePx: Int = 0): DensePoseTexture =
        handle.use { context ->
            val config = maq_densepose_texture_config().also { it.tile_px = tilePx }
            DensePoseTexture(Native.maq_densepose_texture_create(context, config))
        }

    /**
     * Loads the body that [Body.run] fits to people; it has no network. Takes some 10 ms.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (a value out of its range), [Status.NOT_FOUND],
     *   [Status.BAD_BUNDLE] and [Status.UNSUPPORTED] (a bundle of another task).
     */
    fun body(bundle: ModelBundle, config: Body.Config = Body.Config()): Body =
        handle.use { context -> Body(Native.maq_body_create(context, config.native(bundle))) }

    /** Loads the network of edges; takes some 10 ms, so not on the main thread. */
    fun edges(bundle: ModelBundle, config: Edges.Config = Edges.Config()): Edges =
        handle.use { context ->
            Edges(Native.maq_edges_create(context, config.native(bundle)))
        }

    /**
     * Opens a source by a URI: "android:back" (a camera), "image:photo.jpg", "rec:take.maqrec" or
     * "stub:people?count=2&seed=7", with options as "?size=640x480&fps=15"; [Source.schemes] lists the kinds of this build.
     * Video files are not read on Android. Blocks while files are read and devices start: not on the main thread.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (ill-formed URI or option), [Status.UNSUPPORTED]
     *   (scheme, format), [Status.NOT_FOUND], [Status.UNREADABLE], [Status.IMAGE_SIZE]; for cameras also
     *   [Status.DEVICE_LOST], [Status.BUSY], [Status.NO_PERMISSION].
     */
    fun source(uri: String, config: Source.Config = Source.Config()): Source =
        handle.use { context -> Source(context, uri, config) }

    /**
     * Creates a recording (.maqrec), which must not exist yet. Blocks while the file is created.
     *
     * @param source where the frames will come from: its rate and intrinsics are recorded too.
     * @param jpegQuality 1 to 100: pixels are compressed as JPEG of that quality, for which Android 11 is needed; 0:
     *   they stay as they are, 14 MB a second at 640 x 480 (NV12) and 30 frames a second.
     * @param keepPredicted true: predicted frames of a [Predictor] or a [Concealer] are recorded too, marked as such;
     *   false: they are refused.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] and [Status.UNWRITABLE].
     */
    fun recorder(
        path: String,
        source: Source? = null,
        jpegQuality: Int = 0,
        keepPredicted: Boolean = false,
    ): Recorder = handle.use { context -> Recorder(context, path, source, jpegQuality, keepPredicted) }

    /**
     * Creates a predictor for one stream, without networks. Does not block.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for a value out of its range.
     */
    fun predictor(config: Predictor.Config = Predictor.Config()): Predictor = predictor(config, null)

    /**
     * Creates a predictor that samples with the networks of [bundle]: [Predictor.Method.SAMPLED]. Takes some 10 ms, so
     * not on the main thread.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (a value out of its range), [Status.NOT_FOUND],
     *   [Status.BAD_BUNDLE] and [Status.UNSUPPORTED] (a bundle of another task, or without that network).
     */
    fun predictor(
        bundle: ModelBundle,
        config: Predictor.Config = Predictor.Config(method = Predictor.Method.SAMPLED),
    ): Predictor = predictor(config, bundle)

    private fun predictor(config: Predictor.Config, bundle: ModelBundle?): Predictor =
        handle.use { context ->
            Predictor(Native.maq_predictor_create(context, config.native(bundle)))
        }

    /** Creates the check of one stream's camera. Does not block. */
    fun cameraHealth(): CameraHealth = handle.use { context -> CameraHealth(context) }

    /**
     * Creates a concealer of a live source. Until it is closed it takes the frames, and [Source.acquireFrame] fails with
     * [Status.BUSY]. Does not block.
     *
     * @param source stays the app's; closing or stopping it ends the frames of the concealer too.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (a value out of its range), [Status.UNSUPPORTED] (the
     *   source is not live), [Status.BUSY] (it has a concealer already), [Status.OUT_OF_MEMORY] (no more threads).
     */
    fun concealer(source: Source, config: Concealer.Config = Concealer.Config()): Concealer =
        handle.use { context -> Concealer(context, source, config) }

    /** The cameras that are connected now. Blocks while devices answer: not on the main thread. */
    fun cameras(): List<Camera> = handle.use(Camera::all)

    /**
     * A pipeline with the networks of dense pose, which are loaded when its first source is open. Does not block but to
     * copy a bundle in memory.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for a value out of its range.
     */
    fun pipeline(bundle: ModelBundle, config: Pipeline.Config = Pipeline.Config()): Pipeline =
        Pipeline(handle, bundle, config)

    /**
     * Opens a capture: a folder with a COLMAP model and its photos, or with `transforms.json` and a PLY cloud. Blocks
     * while cameras and cloud are read.
     *
     * @throws MaquetteException with [Status.NOT_FOUND] (no folder, no capture or no cloud), [Status.UNREADABLE]
     *   (damaged, or without a usable photo or point), [Status.UNSUPPORTED] (camera models, sizes).
     */
    fun openCapture(folder: String): Capture = handle.use { context -> Capture(context, folder) }

    /**
     * Builds a scene from a capture; takes seconds to minutes, so not on the main thread. Photos that cannot be read
     * are dropped and counted ([Scene.buildStats]).
     *
     * @param bundle networks of scenes.
     * @param progress may cancel; what it throws cancels too, and is thrown.
     * @throws MaquetteException with [Status.CANCELLED]; [Status.BAD_BUNDLE] and [Status.UNSUPPORTED] (a bundle of
     *   another task); [Status.UNREADABLE] (no photo can be used, or sees a point); [Status.OUT_OF_MEMORY];
     *   [Status.INVALID_ARGUMENT].
     */
    fun buildScene(
        capture: Capture,
        bundle: ModelBundle,
        config: SceneBuildConfig = SceneBuildConfig(),
        progress: Progress? = null,
    ): Scene = handle.use { context -> Scene.build(context, capture, bundle, config, progress) }

    /**
     * A builder for a cloud and photos of the app. Blocks while networks are read and the cloud is copied.
     *
     * @param bundle networks of scenes.
     * @throws MaquetteException as [buildScene], and with [Status.INVALID_ARGUMENT] for a cloud without points or with
     *   a point that is not finite.
     */
    fun sceneBuilder(
        cloud: PointCloud,
        bundle: ModelBundle,
        config: SceneBuildConfig = SceneBuildConfig(),
    ): SceneBuilder = handle.use { context -> SceneBuilder(context, cloud, bundle, config) }

    /**
     * Computes a dense cloud from photos and a sparse cloud, such as the feature points of an AR session; takes about a
     * second a photo, so not on the main thread.
     *
     * @param sparse a photo needs 12 of its points in its image, and another photo that sees them from elsewhere.
     * @param threads 0: the large cores, at most 4.
     * @param maxPoints if there are more points, a random selection is kept. 0: 1.5 million.
     * @param progress may cancel; what it throws cancels too, and is thrown.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT], [Status.NOT_FOUND] (no photo has depth),
     *   [Status.CANCELLED], [Status.OUT_OF_MEMORY].
     */
    fun denseCloud(
        photos: List<PosedPhoto>,
        sparse: PointCloud,
        threads: Int = 0,
        maxPoints: Long = 0,
        progress: Progress? = null,
    ): DenseCloud =
        handle.use { context -> DenseCloud(context, photos, sparse, threads, maxPoints, progress) }

    /**
     * Opens a scene file (.maqs), which is checked completely and mapped: it must not be written to while the scene is
     * open.
     *
     * @throws MaquetteException with [Status.NOT_FOUND], [Status.UNREADABLE] (damaged, or not a scene) and
     *   [Status.UNSUPPORTED] (another version).
     */
    fun openScene(path: String): Scene =
        handle.use { context -> Scene(Native.maq_scene_open(context, textOf(path)), null) }

    /** Opens a scene file in a direct buffer, from its start to its capacity; it is copied. Fails as for a path. */
    fun openScene(file: ByteBuffer): Scene =
        handle.use { Scene(Native.maq_scene_open_memory(it, Memory(file), file.capacity().toLong()), null) }

    /**
     * Opens a scene file of the app's assets. Fails as for a path.
     *
     * @throws IOException if it is not there.
     */
    fun openScene(assets: AssetManager, path: String): Scene = openScene(ModelBundle.mappedOrRead(assets, path))

    /**
     * A renderer of a scene; takes some 100 ms, so not on the main thread.
     *
     * @param bundle the networks that built the scene.
     * @throws MaquetteException with [Status.BAD_BUNDLE], also for other networks than those that built it.
     */
    fun sceneRenderer(
        scene: Scene,
        bundle: ModelBundle,
        config: SceneRenderer.Config = SceneRenderer.Config(),
    ): SceneRenderer = handle.use { context -> SceneRenderer(context, scene, bundle, config) }

    /**
     * Loads the network of heads; takes some 100 ms, so not on the main thread.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (a value out of its range), [Status.NOT_FOUND],
     *   [Status.BAD_BUNDLE] and [Status.UNSUPPORTED] (a bundle of another task).
     */
    fun headBuilder(bundle: ModelBundle, config: HeadBuilder.Config = HeadBuilder.Config()): HeadBuilder =
        handle.use { context ->
            HeadBuilder(Native.maq_head_builder_create(context, config.native(bundle)))
        }

    /**
     * Opens a head file (.maqh); no networks are needed. Blocks while it is read.
     *
     * @throws MaquetteException with [Status.NOT_FOUND], [Status.UNREADABLE] (damaged, or not a head) and
     *   [Status.UNSUPPORTED] (another version).
     */
    fun openHead(path: String): Head = handle.use { context -> Head(Native.maq_head_open(context, textOf(path))) }

    /** Opens a head file in a direct buffer, from its start to its capacity; it is copied. Fails as for a path. */
    fun openHead(file: ByteBuffer): Head = 
        handle.use { Head(Native.maq_head_open_memory(it, Memory(file), file.capacity().toLong())) }

    /**
     * Opens a head file of the app's assets. Fails as for a path.
     *
     * @throws IOException if it is not there.
     */
    fun openHead(assets: AssetManager, path: String): Head = openHead(ModelBundle.mappedOrRead(assets, path))

    /**
     * Creates a renderer of a head's mesh.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (the config).
     */
    fun headRenderer(mesh: HeadMesh, config: HeadRenderer.Config = HeadRenderer.Config()): HeadRenderer =
        handle.use { context -> HeadRenderer(context, mesh, config) }

    override fun close() = handle.close()

    companion object {
        /** The version of the native library. */
        val version: String get() = textAt(Native.maq_get_sdk_version())
    }
}

/** How much is logged. */
enum class LogLevel(internal val code: Int) {
    OFF(MAQ_LOG_OFF),
    ERROR(MAQ_LOG_ERROR),
    WARNING(MAQ_LOG_WARNING),
    INFO(MAQ_LOG_INFO),
    DEBUG(MAQ_LOG_DEBUG),
}
