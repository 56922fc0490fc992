package dev.maquette

import dev.maquette.jni.*

/**
 * Posed photos of an environment and a point cloud, in a folder. Made by [Maquette.openCapture]. Photos are read when they are
 * needed. All functions may be called from any thread.
 */
class Capture internal constructor(context: Long, folder: String) : AutoCloseable {
    internal val handle = Handle(this, Native.maq_capture_open(context, textOf(folder)), Native::maq_capture_destroy)

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

    /** Number of points of the point cloud. */
    val pointCount: Long

    /** Up in the world: x, y, z of length 1. */
    val up: List<Double>

    /** Parts of the capture that cannot be used. */
    val drops: List<Drop>

    init {
        val info = handle.read(maq_capture_info(), Native::maq_capture_get_info)
        pointCount = info.point_count
        up = info.up
        views =
            List(info.view_count) { index ->
                val view = handle.read(maq_capture_view()) { it, view -> Native.maq_capture_get_view(it, index, view) }
                View(view.name.text(), PinholeCamera.of(view.camera), view.is_held_out != 0)
            }
        drops =
            List(info.drop_count) { index ->
                val drop = handle.read(maq_capture_drop()) { it, drop -> Native.maq_capture_get_drop(it, index, drop) }
                Drop(drop.reason.text(), drop.count)
            }
    }

    /**
     * Reads a photo and removes its lens distortion: BGR8, of the size of the view's camera. Blocks while it is read.
     *
     * @param index in [views].
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for another index, [Status.NOT_FOUND] and
     *   [Status.UNREADABLE].
     */
    fun loadView(index: Int): Frame = Frame(handle.use { Native.maq_capture_load_view(it, index) })

    /** Scenes built from it and frames loaded from it stay valid. */
    override fun close() = handle.close()
}
