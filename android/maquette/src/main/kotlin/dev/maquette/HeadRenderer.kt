package dev.maquette

import dev.maquette.jni.*

/**
 * Renders the mesh of a head from any camera. Made by [Maquette.headRenderer]; the mesh may be closed.
 *
 * ```
 * renderer.run(renderer.camera(yawRad = 0.5)).use { image -> show(image.toBitmap()) }
 * ```
 */
class HeadRenderer internal constructor(context: Long, mesh: HeadMesh, config: Config) : AutoCloseable {
    private val handle =
        Handle(
            this,
            mesh.handle.use { Native.maq_head_renderer_create(context, config.native(), it) },
            Native::maq_head_renderer_destroy,
        )

    /** Chooses what the colours of an image show. */
    enum class Shading(internal val code: Int) {
        /** The mesh's texture, or its colours if it has none; in soft light. */
        COLOUR(MAQ_HEAD_SHADING_COLOUR),

        /** Grey, in soft light. */
        SHAPE(MAQ_HEAD_SHADING_SHAPE),

        /** Red to the right, green up, blue to the camera, as in normal maps. */
        NORMALS(MAQ_HEAD_SHADING_NORMALS),

        /** Template points: red to the person's left, green up, blue to the front. */
        TEMPLATE(MAQ_HEAD_SHADING_TEMPLATE),

        /** White is near, black is far. */
        DEPTH(MAQ_HEAD_SHADING_DEPTH),
    }

    /**
     * @property threads 0: the large cores, at most 4.
     * @property nearM points nearer to the camera along its axis are not drawn; 0: 0.01.
     * @property shadingStrength how much darker surfaces are that face away from the light, up to 1 (black); 0: 0.35;
     *   [SHADING_STRENGTH_OFF]: not at all.
     * @property disableAntialiasing one sample a pixel, which is faster; false: four samples.
     * @property background a colour as of `android.graphics.Color`, over which images are composed by their alpha; its own
     *   alpha is not used. null: colours are 0 where no head is.
     * @property imagePoolSize images that the app may hold at once, 1 to 64; 0: 4.
     */
    data class Config(
        val threads: Int = 0,
        val nearM: Double = 0.0,
        val shading: Shading = Shading.COLOUR,
        val shadingStrength: Float = 0f,
        val disableAntialiasing: Boolean = false,
        val background: Int? = null,
        val imagePoolSize: Int = 0,
    ) {
        internal fun native() =
            maq_head_renderer_config().also {
                it.threads = threads
                it.near_m = nearM
                it.shading = shading.code
                it.shading_strength = shadingStrength
                it.disable_antialiasing = disableAntialiasing.toInt()
                it.use_background = (background != null).toInt()
                it.background = rgbOf(background)
                it.image_pool_size = imagePoolSize
            }

        companion object {
            /** For [shadingStrength]: colours are shown without light. */
            const val SHADING_STRENGTH_OFF = MAQ_HEAD_SHADING_STRENGTH_OFF.toFloat()
        }
    }

    /**
     * A camera that sees the whole head from any side.
     *
     * @param yawRad angle to the person's left of the front.
     * @param pitchRad angle above.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (an angle that is not finite) and [Status.IMAGE_SIZE].
     */
    fun camera(yawRad: Double = 0.0, pitchRad: Double = 0.0, widthPx: Int = 640, heightPx: Int = 480): PinholeCamera =
        PinholeCamera.of(
            handle.read(maq_pinhole_camera()) { it, camera ->
                Native.maq_head_renderer_get_camera(it, yawRad, pitchRad, widthPx, heightPx, camera)
            },
        )

    /** Sets the shading of later images; not while [run] runs. */
    fun setShading(shading: Shading) = handle.use { Native.maq_head_renderer_set_shading(it, shading.code) }

    /**
     * Renders the view of a camera, in its size. Takes milliseconds, so not on the main thread; one call at a time.
     *
     * @param camera without distortion, outside of the head: [HeadRenderer.camera], one of [Head.cameras], or another in the
     *   head's frame.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (an invalid camera), [Status.IMAGE_SIZE],
     *   [Status.POOL_EMPTY] while [Config.imagePoolSize] images are open, [Status.OUT_OF_MEMORY].
     */
    fun run(camera: PinholeCamera): RenderedImage =
        RenderedImage(handle.use { Native.maq_head_renderer_run(it, camera.native()) })

    /** Images that are open stay valid. */
    override fun close() = handle.close()
}
