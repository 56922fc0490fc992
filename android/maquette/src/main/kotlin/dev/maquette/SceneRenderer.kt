package dev.maquette

import dev.maquette.jni.*

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
            scene.handle.use { Native.maq_scene_renderer_create(context, config.native(bundle), it) },
            Native::maq_scene_renderer_destroy,
        )

    /**
     * @property threads 0: the large cores, at most 4.
     * @property background a colour as of `android.graphics.Color`, over which images are composed by their alpha; its
     *   own alpha is not used. null: pixels without points have the mean colour that the photos show beside the points.
     * @property nearDepth points nearer to the camera, along its axis, are not drawn; units of the scene.
     * @property imagePoolSize images that the app may hold at once, 1 to 64; 0: 4.
     */
    data class Config(
        val threads: Int = 0,
        val background: Int? = null,
        val nearDepth: Double = 0.0,
        val imagePoolSize: Int = 0,
    ) {
        internal fun native(bundle: ModelBundle) =
            maq_scene_renderer_config().also {
                it.model.set(bundle, threads)
                it.use_background = (background != null).toInt()
                it.background = rgbOf(background)
                it.near_depth = nearDepth
                it.image_pool_size = imagePoolSize
            }
    }

    /**
     * Renders the view of a camera, in its size. Takes milliseconds, the first image of a size longer, so not on the main
     * thread; one call at a time.
     *
     * @param camera without distortion.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (an invalid camera), [Status.IMAGE_SIZE],
     *   [Status.POOL_EMPTY] while [Config.imagePoolSize] images are open.
     */
    fun run(camera: PinholeCamera): RenderedImage =
        RenderedImage(handle.use { Native.maq_scene_renderer_run(it, camera.native()) })

    /** Images that are open stay valid. */
    override fun close() = handle.close()
}
