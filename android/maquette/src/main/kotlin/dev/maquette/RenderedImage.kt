package dev.maquette

import android.graphics.Bitmap
import dev.maquette.jni.NativeImage
import java.nio.ByteBuffer
import java.nio.ByteOrder

/**
 * An image of a [HeadRenderer] or a [SceneRenderer], from a pool: close it soon. All functions may be called from any
 * thread.
 */
class RenderedImage internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, NativeImage::release)

    val widthPx: Int
    val heightPx: Int

    init {
        val (width, height) = handle.use(NativeImage::size)
        widthPx = width
        heightPx = height
    }

    /** The planes of an image; 0 where nothing is. */
    enum class Plane(internal val pixelBytes: Int) {
        /** Three bytes a pixel: blue, green, red. */
        BGR(3),

        /** A byte a pixel: coverage, 0 to 255. */
        ALPHA(1),

        /** A float a pixel: depth along the optical axis, in metres for heads and in units of the scene for scenes. */
        DEPTH(4),

        /** Heads only. Three floats a pixel: the outward normal in the camera (x right, y down, z forward), of length 1. */
        NORMALS(12),

        /** Heads only. Three floats a pixel: the point of the template head, in metres. */
        TEMPLATE_POINTS(12),
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
            NativeImage.plane(it, plane.ordinal + 1, plane.pixelBytes * widthPx, heightPx)
                .asReadOnlyBuffer().order(ByteOrder.nativeOrder())
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
            val s = handle.use(NativeImage::sceneStats)
            return SceneStats(s[0], s[1], s[2], s[3], s[4], s[5].toInt(), s[6].toLong(), s[7].toLong(), s[8].toLong())
        }

    /**
     * Writes the colours to a file in the format of its extension, PNG (.png) or JPEG (.jpg), atomically, in a folder
     * that exists. Blocks while the file is written.
     *
     * @param withAlpha only for PNG.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension, alpha in a JPEG file),
     *   [Status.UNWRITABLE] and [Status.RUNTIME_LIBRARY] (this build has no libmaquette_files.so; [toBitmap] and
     *   Bitmap.compress need none).
     */
    fun save(path: String, withAlpha: Boolean = false) =
        handle.use { NativeImage.save(it, path.toByteArray(), if (withAlpha) 1 else 0) }

    override fun close() = handle.close()
}
