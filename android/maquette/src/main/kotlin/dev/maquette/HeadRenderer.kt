package dev.maquette

import android.graphics.Bitmap
import dev.maquette.jni.NativeHead
import java.nio.ByteBuffer
import java.nio.ByteOrder

/**
 * Draws the mesh of a head from any camera. Made by [Maquette.headRenderer]; the head may be closed.
 *
 * ```
 * renderer.run(renderer.camera(yawRad = 0.5)).use { image -> show(image.toBitmap()) }
 * ```
 */
class HeadRenderer internal constructor(context: Long, head: Head, config: Config) : AutoCloseable {
    private val handle =
        Handle(
            this,
            head.useMesh {
                val bundle = config.mesh.bundle
                NativeHead.createRenderer(
                    context,
                    it,
                    config.values(),
                    config.mesh.values(),
                    bundle?.folder,
                    bundle?.names,
                    bundle?.buffers,
                )
            },
            NativeHead::destroyRenderer,
        )

    /** What the colours of a picture show. */
    enum class Shading {
        /** The head's colours, in soft light. */
        COLOUR,

        /** Grey, in soft light. */
        SHAPE,

        /** Red to the right, green up, blue to the camera, as in normal maps. */
        NORMALS,

        /** Template points: red to the person's left, green to the back, blue up. */
        TEMPLATE,

        /** Near is white, far is black. */
        DEPTH,
        ;

        internal val code get() = ordinal + 1
    }

    /**
     * @property threads 0: the large cores, at most 4.
     * @property mesh that is drawn.
     * @property nearM what is nearer to the camera, along its axis, is not drawn.
     * @property light how much darker is what is turned away from the light, 0 (not at all) to 1 (black).
     * @property smoothEdges edges are drawn with four samples a pixel; false: with one, which is faster.
     * @property background a colour as of `android.graphics.Color`, that pictures are composed over by their alpha; its own
     *   alpha is not used. null: they are not, and colours are 0 where there is no head.
     * @property imagePoolSize images that the app may hold at once, 1 to 64.
     */
    data class Config(
        val threads: Int = 0,
        val mesh: HeadMeshOptions = HeadMeshOptions(),
        val nearM: Double = 0.01,
        val shading: Shading = Shading.COLOUR,
        val light: Float = 0.35f,
        val smoothEdges: Boolean = true,
        val background: Int? = null,
        val imagePoolSize: Int = 4,
    ) {
        internal fun values(): DoubleArray {
            val rgb = background ?: 0
            return doubleArrayOf(
                threads.toDouble(),
                nearM,
                shading.code.toDouble(),
                light.toDouble(),
                if (smoothEdges) 1.0 else 0.0,
                if (background != null) 1.0 else 0.0,
                (rgb shr 16 and 0xFF).toDouble(),
                (rgb shr 8 and 0xFF).toDouble(),
                (rgb and 0xFF).toDouble(),
                imagePoolSize.toDouble(),
            )
        }
    }

    /**
     * A camera that sees the whole head, whichever way it is turned.
     *
     * @param yawRad how far it stands to the person's left of the front.
     * @param pitchRad how far above.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (an angle that is not finite) and [Status.IMAGE_SIZE].
     */
    fun camera(
        yawRad: Double = 0.0,
        pitchRad: Double = 0.0,
        widthPx: Int = 640,
        heightPx: Int = 480,
    ): PinholeCamera =
        PinholeCamera.of(handle.use { NativeHead.orbitCamera(it, yawRad, pitchRad, widthPx, heightPx) })

    /** Has later pictures show something else; not while [run] runs. */
    fun setShading(shading: Shading) = handle.use { NativeHead.setShading(it, shading.code) }

    /**
     * Renders the head as a camera sees it, in a picture of its size. Takes milliseconds, so not on the main thread; one
     * call at a time.
     *
     * @param camera without distortion, outside of the head: [HeadRenderer.camera], one of [Head.cameras], or any other in
     *   the head's coordinates.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (an invalid camera), [Status.IMAGE_SIZE],
     *   [Status.POOL_EMPTY] while [Config.imagePoolSize] images are open, [Status.OUT_OF_MEMORY].
     */
    fun run(camera: PinholeCamera): HeadImage {
        val image = handle.use { NativeHead.render(it, camera.values()) }
        return HeadImage(image, camera.intrinsics.widthPx, camera.intrinsics.heightPx)
    }

    /** Images that are open stay valid. */
    override fun close() = handle.close()
}

/** A picture of a head, from a pool: close it soon. All functions may be called from any thread. */
class HeadImage internal constructor(pointer: Long, val widthPx: Int, val heightPx: Int) : AutoCloseable {
    private val handle = Handle(this, pointer, NativeHead::releaseImage)

    /** What is known of each pixel; 0 where there is no head. */
    enum class Plane(internal val pixelBytes: Int) {
        /** Three bytes a pixel: blue, green, red; what [HeadRenderer.Shading] says. */
        BGR(3),

        /** A byte a pixel: coverage by the head, 0 to 255. */
        ALPHA(1),

        /** A float a pixel: metres along the optical axis. */
        DEPTH(4),

        /** Three floats a pixel: outwards, in the camera (x to the right, y down, z forward), of length 1. */
        NORMALS(12),

        /** Three floats a pixel: metres, on the template head. */
        TEMPLATE_POINTS(12),
    }

    /**
     * A plane as it lies in native memory, [heightPx] rows of [widthPx] pixels, read-only, in native byte order and
     * without a copy. It must not be read after the image has been closed: [toBitmap] gives what stays.
     */
    fun plane(plane: Plane): ByteBuffer =
        handle.use {
            NativeHead.planeOfImage(it, plane.ordinal + 1, plane.pixelBytes * widthPx, heightPx)
                .asReadOnlyBuffer().order(ByteOrder.nativeOrder())
        }

    /**
     * A copy as an ARGB_8888 bitmap.
     *
     * @param withAlpha false: it is opaque; true: transparent where there is no head, to be drawn over a photo.
     */
    fun toBitmap(withAlpha: Boolean = false): Bitmap =
        handle.use {
            bitmapOf(plane(Plane.BGR), if (withAlpha) plane(Plane.ALPHA) else null, widthPx, heightPx)
        }

    /**
     * Writes the picture to a file in the format of its extension, PNG (.png) or JPEG (.jpg), atomically, in a folder
     * that exists. Blocks while it is written.
     *
     * @param withAlpha only for PNG.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension, alpha in a JPEG file),
     *   [Status.UNWRITABLE] and [Status.RUNTIME_LIBRARY] (this build has no libmaquette_files.so; [toBitmap] and
     *   Bitmap.compress need none).
     */
    fun save(path: String, withAlpha: Boolean = false) =
        handle.use { NativeHead.saveImage(it, path.toByteArray(), withAlpha) }

    override fun close() = handle.close()
}
