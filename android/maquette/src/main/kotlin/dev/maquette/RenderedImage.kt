package dev.maquette

import android.graphics.Bitmap
import dev.maquette.jni.*
import java.nio.ByteBuffer

/**
 * An image of a [HeadRenderer] or a [SceneRenderer], from a pool: close it soon. All functions may be called from any
 * thread.
 */
class RenderedImage internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, Native::maq_image_release)

    val widthPx: Int
    val heightPx: Int

    init {
        val (width, height) = handle.use { pairOf { width, height -> Native.maq_image_get_size(it, width, height) } }
        widthPx = width
        heightPx = height
    }

    /** The planes of an image; 0 where nothing is. */
    enum class Plane(internal val code: Int, internal val pixelBytes: Int) {
        /** Three bytes a pixel: blue, green, red. */
        BGR(MAQ_IMAGE_PLANE_BGR, 3),

        /** A byte a pixel: coverage, 0 to 255. */
        ALPHA(MAQ_IMAGE_PLANE_ALPHA, 1),

        /** A float a pixel: depth along the optical axis, in metres for heads and in units of the scene for scenes. */
        DEPTH(MAQ_IMAGE_PLANE_DEPTH, 4),

        /** Heads only. Three floats a pixel: the outward normal in the camera (x right, y down, z forward), of length 1. */
        NORMALS(MAQ_IMAGE_PLANE_NORMALS, 12),

        /** Heads only. Three floats a pixel: the point of the template head, in metres. */
        TEMPLATE_POINTS(MAQ_IMAGE_PLANE_TEMPLATE_POINTS, 12),
    }

    /**
     * Wall-clock milliseconds and counts of an image of a scene.
     *
     * @property projectMs points to pixels.
     * @property shadeMs descriptors of the visible points, and coarser rasters.
     * @property refineMs the network.
     * @property resampleMs back to the camera's roll, colours to bytes.
     * @property drawnBlocks blocks within the view frustum, with [drawnPoints] points.
     * @property shadedPoints points that are front-most at some pixel.
     * @property refinedPixels pixels that the network computed.
     */
    data class SceneStats(
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
     * A plane in native memory: [heightPx] rows of [widthPx] pixels, read-only, in native byte order, without a copy. It
     * must not be read after the image has been closed; [toBitmap] makes a copy.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (the image has no such plane).
     */
    fun plane(plane: Plane): ByteBuffer =
        handle.use {
            planeOf(plane.pixelBytes * widthPx, heightPx) { pixels, stride ->
                Native.maq_image_get_plane(it, plane.code, pixels, stride)
            }
        }

    /**
     * A copy as an ARGB_8888 bitmap.
     *
     * @param withAlpha false: it is opaque; true: transparent where nothing is, to be drawn over a photo.
     */
    fun toBitmap(withAlpha: Boolean = false): Bitmap =
        handle.use {
            bitmapOf(plane(Plane.BGR), if (withAlpha) plane(Plane.ALPHA) else null, widthPx, heightPx)
        }

    /**
     * Times and counts of an image of a [SceneRenderer].
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (an image of a head).
     */
    val sceneStats: SceneStats
        get() {
            val s = handle.read(maq_scene_render_stats(), Native::maq_image_get_scene_stats)
            return SceneStats(
                s.project_ms, s.shade_ms, s.refine_ms, s.resample_ms, s.total_ms, s.drawn_block_count,
                s.drawn_point_count, s.shaded_point_count, s.refined_pixel_count,
            )
        }

    /**
     * Writes the colours to a file in the format of its extension, PNG (.png) or JPEG (.jpg), atomically, in a folder
     * that exists. Blocks while the file is written.
     *
     * @param withAlpha only for PNG.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension, alpha in a JPEG file)
     *   and [Status.UNWRITABLE].
     */
    fun save(path: String, withAlpha: Boolean = false) =
        handle.use { Native.maq_image_save(it, textOf(path), if (withAlpha) MAQ_IMAGE_ALPHA_ON else MAQ_IMAGE_ALPHA_OFF) }

    override fun close() = handle.close()
}
