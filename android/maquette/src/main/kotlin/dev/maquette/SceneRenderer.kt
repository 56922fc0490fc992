package dev.maquette

import dev.maquette.jni.NativeScene

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
     * @property background a colour as of `android.graphics.Color`, over which images are composed by their alpha; its
     *   own alpha is not used. null: pixels without points have the mean colour that the photos show beside the points.
     * @property nearDepth points nearer to the camera, along its axis, are not drawn; units of the scene.
     * @property imagePoolSize images that the app may hold at once, 1 to 64; 0: 4.
     * @property allowSpinning true: idle threads spin for a while, which is faster; false: they sleep, which saves
     *   energy.
     */
    data class Config(
        val threads: Int = 0,
        val background: Int? = null,
        val nearDepth: Double = 0.0,
        val imagePoolSize: Int = 0,
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
     * Renders the view of a camera, in its size. Takes milliseconds, the first image of a size longer, so not on the main
     * thread; one call at a time.
     *
     * @param camera without distortion.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (an invalid camera), [Status.IMAGE_SIZE],
     *   [Status.POOL_EMPTY] while [Config.imagePoolSize] images are open.
     */
    fun run(camera: PinholeCamera): RenderedImage =
        RenderedImage(handle.use { NativeScene.render(it, camera.values()) })

    /** Images that are open stay valid. */
    override fun close() = handle.close()
}
