package dev.maquette

import android.graphics.Bitmap
import dev.maquette.jni.NativeScene
import java.nio.ByteBuffer
import java.nio.ByteOrder

/**
 * Renders views of a scene. Made by [Maquette.sceneRenderer]; the scene may be closed.
 *
 * ```
 * renderer.run(camera).use { image -> show(image.toBitmap()) }
 * ```
 */
class SceneRenderer internal constructor(
    context: Long,
    scene: Scene,
    bundle: ModelBundle,
    config: Config,
) : AutoCloseable {
    private val handle =
        Handle(
            this,
            scene.handle.use {
                NativeScene.createRenderer(
                    context,
                    it,
                    bundle.folder,
                    bundle.names,
                    bundle.buffers,
                    config.values(),
                )
            },
            NativeScene::destroyRenderer,
        )

    /**
     * @property threads 0: the large cores, at most 4.
     * @property background a colour as of `android.graphics.Color`, that pictures are composed over by their alpha; its
     *   own alpha is not used. null: where no points are near they get the mean colour that the photos show there.
     * @property nearDepth points nearer to the camera, along its axis, are not drawn; units of the scene.
     * @property imagePoolSize images that the app may hold at once, 1 to 64.
     * @property allowSpinning true: idle threads spin for a while, which is faster; false: they sleep, which saves
     *   energy.
     */
    data class Config(
        val threads: Int = 0,
        val background: Int? = null,
        val nearDepth: Double = 0.0,
        val imagePoolSize: Int = 4,
        val allowSpinning: Boolean = false,
    ) {
        internal fun values(): DoubleArray {
            val rgb = background ?: 0
            return doubleArrayOf(
                threads.toDouble(),
                if (background != null) 1.0 else 0.0,
                (rgb shr 16 and 0xFF).toDouble(),
                (rgb shr 8 and 0xFF).toDouble(),
                (rgb and 0xFF).toDouble(),
                nearDepth,
                imagePoolSize.toDouble(),
                if (allowSpinning) 1.0 else 0.0,
            )
        }
    }

    /**
     * Renders the view of a camera in a picture of its size. Takes milliseconds, the first picture of a size longer, so
     * not on the main thread; one call at a time.
     *
     * @param camera without distortion.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (an invalid camera), [Status.IMAGE_SIZE],
     *   [Status.POOL_EMPTY] while [Config.imagePoolSize] images are open.
     */
    fun run(camera: PinholeCamera): SceneImage {
        val image = handle.use { NativeScene.render(it, camera.values()) }
        return SceneImage(image, camera.intrinsics.widthPx, camera.intrinsics.heightPx)
    }

    /** Images that are open stay valid. */
    override fun close() = handle.close()
}

/** A rendered picture, from a pool: close it soon. All functions may be called from any thread. */
class SceneImage internal constructor(pointer: Long, val widthPx: Int, val heightPx: Int) : AutoCloseable {
    private val handle = Handle(this, pointer, NativeScene::releaseImage)

    /** What is known of each pixel. */
    enum class Plane(internal val pixelBytes: Int) {
        /** Three bytes a pixel: blue, green, red. */
        BGR(3),

        /** A byte a pixel: coverage by points, 0 (none near) to 255. */
        ALPHA(1),

        /** A float a pixel: depth of the nearest point along the optical axis, in units of the scene; 0: none near. */
        DEPTH(4),
    }

    /**
     * Wall-clock milliseconds, and counts.
     *
     * @property projectMs points to pixels.
     * @property shadeMs descriptors of the visible points, and coarser rasters.
     * @property refineMs the network.
     * @property resampleMs back to the camera's roll, colours to bytes.
     * @property drawnBlocks blocks within the view frustum, with [drawnPoints] points.
     * @property shadedPoints front-most at some pixel.
     * @property refinedPixels that the network computed.
     */
    data class Stats(
        val projectMs: Double,
        val shadeMs: Double,
        val refineMs: Double,
        val resampleMs: Double,
        val totalMs: Double,
        val drawnBlocks: Int,
        val drawnPoints: Long,
        val shadedPoints: Long,
        val refinedPixels: Long,
    )

    /**
     * A plane as it lies in native memory, [heightPx] rows of [widthPx] pixels, read-only, in native byte order and
     * without a copy. It must not be read after the image has been closed: [toBitmap] gives what stays.
     */
    fun plane(plane: Plane): ByteBuffer =
        handle.use {
            NativeScene.planeOfImage(it, plane.ordinal + 1, plane.pixelBytes * widthPx, heightPx)
                .asReadOnlyBuffer().order(ByteOrder.nativeOrder())
        }

    /** A copy as an opaque ARGB_8888 bitmap. */
    fun toBitmap(): Bitmap = handle.use { bitmapOf(plane(Plane.BGR), null, widthPx, heightPx) }

    /** Of this picture. */
    val stats: Stats
        get() {
            val s = handle.use(NativeScene::statsOfImage)
            return Stats(
                s[0], s[1], s[2], s[3], s[4], s[5].toInt(), s[6].toLong(), s[7].toLong(), s[8].toLong(),
            )
        }

    /**
     * Writes the picture to a file in the format of its extension, PNG (.png) or JPEG (.jpg), atomically, in a folder
     * that exists. Blocks while it is written.
     *
     * @param withAlpha only for PNG.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension), [Status.UNWRITABLE] and
     *   [Status.RUNTIME_LIBRARY] (this build has no libmaquette_files.so; [toBitmap] and Bitmap.compress need none).
     */
    fun save(path: String, withAlpha: Boolean = false) =
        handle.use { NativeScene.saveImage(it, path.toByteArray(), withAlpha) }

    override fun close() = handle.close()
}
