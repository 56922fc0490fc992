package dev.maquette

import dev.maquette.jni.NativeScene

/**
 * Posed photos of an environment and a point cloud, in a folder. Made by [Maquette.openCapture]. Photos are read when they are
 * needed. All functions may be called from any thread.
 */
class Capture internal constructor(context: Long, folder: String) : AutoCloseable {
    internal val handle =
        Handle(this, NativeScene.openCapture(context, folder.toByteArray()), NativeScene::closeCapture)

    /**
     * A photo.
     *
     * @property name in the capture.
     * @property camera of the photo after its lens distortion has been removed.
     * @property isHeldOut for comparison only: scenes are not built from it, unless [SceneBuildConfig.useHeldOut].
     */
    data class View(val name: String, val camera: PinholeCamera, val isHeldOut: Boolean)

    /** [count] parts of the capture that cannot be used, and why. */
    data class Drop(val reason: String, val count: Long)

    /** The photos. */
    val views: List<View>

    /** Of the cloud. */
    val pointCount: Long

    /** Up in the world: x, y, z of length 1. */
    val up: List<Double>

    /** Parts of the capture that cannot be used. */
    val drops: List<Drop>

    init {
        val info = handle.use(NativeScene::captureInfo)
        pointCount = info[1].toLong()
        up = info.drop(3)
        views =
            List(info[0].toInt()) { index ->
                val numbers = handle.use { NativeScene.viewNumbers(it, index) }
                val name = handle.use { NativeScene.viewName(it, index) }.decodeToString()
                View(name, PinholeCamera.of(numbers), numbers.last() != 0.0)
            }
        drops =
            List(info[2].toInt()) { index ->
                val count = LongArray(1)
                Drop(handle.use { NativeScene.drop(it, index, count) }.decodeToString(), count[0])
            }
    }

    /**
     * Reads a photo and removes its lens distortion: BGR8, of the size of the view's camera. Blocks while it is read.
     *
     * @param index in [views].
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for another index, [Status.NOT_FOUND] and
     *   [Status.UNREADABLE].
     */
    fun loadView(index: Int): Frame = Frame(handle.use { NativeScene.loadView(it, index) })

    /** Scenes built from it and frames loaded from it stay valid. */
    override fun close() = handle.close()
}
