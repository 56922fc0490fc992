package dev.maquette

import dev.maquette.jni.NativeScene

/**
 * An environment that can be seen from new viewpoints with a [SceneRenderer]. Made by [Maquette.buildScene],
 * [SceneBuilder.finish] and [Maquette.openScene]. All functions may be called from any thread.
 *
 * @property buildStats how it was built; null if it was opened.
 */
class Scene internal constructor(pointer: Long, val buildStats: SceneBuildStats?) : AutoCloseable {
    internal val handle = Handle(this, pointer, NativeScene::close)

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
        handle.use { scene ->
            val networks = ByteArray(32)
            val i = NativeScene.info(scene, networks)
            val (up, boundsMin, boundsMax) = i.drop(4).chunked(3)
            Info(
                i[0].toInt(), i[1].toLong(), i[2].toLong(), i[3].toLong(), up, boundsMin, boundsMax,
                networks.joinToString("") { "%02x".format(it) },
            )
        }

    /**
     * Writes the scene to a file (.maqs), atomically, in a folder that exists. Blocks until it is on the disk.
     *
     * @throws MaquetteException with [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { NativeScene.save(it, path.toByteArray()) }

    /** Writes positions and mean colours as a binary PLY file, for other programs; fails as [save]. */
    fun savePly(path: String) = handle.use { NativeScene.savePly(it, path.toByteArray()) }

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
            val scene =
                capture.handle.use {
                    NativeScene.build(
                        context,
                        it,
                        bundle.folder,
                        bundle.names,
                        bundle.buffers,
                        config.values(),
                        progress?.let(::NativeProgress),
                    )
                }
            return Scene(scene, SceneBuildStats.of(NativeScene.buildStats(scene)))
        }
    }
}
