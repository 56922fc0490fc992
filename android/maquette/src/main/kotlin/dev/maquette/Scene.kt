package dev.maquette

import dev.maquette.jni.*

/**
 * An environment that can be seen from new viewpoints with a [SceneRenderer]. Made by [Maquette.buildScene],
 * [SceneBuilder.finish] and [Maquette.openScene]. All functions may be called from any thread.
 *
 * @property buildStats how it was built; null if it was opened.
 */
class Scene internal constructor(pointer: Long, val buildStats: SceneBuildStats?) : AutoCloseable {
    internal val handle = Handle(this, pointer, Native::maq_scene_destroy)

    /**
     * A description of a scene.
     *
     * @property coefficientBits of its descriptors: 8, 16 or 32.
     * @property viewDependentPoints points whose descriptors depend on the viewing direction.
     * @property blockCount boxes of neighbouring points, the units of frustum culling.
     * @property up of the world: x, y, z of length 1.
     * @property boundsMin of the points: x, y, z in the world, in units of the scene; so is [boundsMax].
     * @property networksSha256 of the networks that built it, in hexadecimal; a renderer needs the same.
     */
    data class Info(
        val coefficientBits: Int,
        val pointCount: Long,
        val viewDependentPoints: Long,
        val blockCount: Long,
        val up: List<Double>,
        val boundsMin: List<Double>,
        val boundsMax: List<Double>,
        val networksSha256: String,
    )

    /** Its description. */
    val info: Info =
        with(handle.read(maq_scene_info(), Native::maq_scene_get_info)) {
            val sha256 = networks_sha256.joinToString("") { "%02x".format(it) }
            Info(coefficient_bits, point_count, view_dependent_count, block_count, up, bounds_min, bounds_max, sha256)
        }

    /**
     * Writes the scene to a file (.maqs), atomically, in a folder that exists. Blocks until it is on the disk.
     *
     * @throws MaquetteException with [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { Native.maq_scene_save(it, textOf(path)) }

    /** Writes positions and mean colours as a binary PLY file, for other programs; fails as [save]. */
    fun savePly(path: String) = handle.use { Native.maq_scene_save_ply(it, textOf(path)) }

    /** Its renderers stay usable. */
    override fun close() = handle.close()

    internal companion object {
        fun build(
            context: Long,
            capture: Capture,
            bundle: ModelBundle,
            config: SceneBuildConfig,
            progress: Progress?,
        ): Scene {
            val native = config.native(bundle)
            val scene =
                capture.handle.use { from ->
                    Callbacks.during(progress, discard = Native::maq_scene_destroy) {
                        Native.maq_scene_build(context, native, from)
                    }
                }
            return of(scene)
        }

        fun of(scene: Long): Scene {
            val stats = maq_scene_build_stats().also { Native.maq_scene_get_build_stats(scene, it) }
            return Scene(scene, SceneBuildStats.of(stats))
        }
    }
}
