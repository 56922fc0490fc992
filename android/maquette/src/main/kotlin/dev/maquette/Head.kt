package dev.maquette

import dev.maquette.jni.*

/**
 * A 3D head, coloured and in metres. Made by [HeadBuilder.fit] and [Maquette.openHead]; shown by a [HeadRenderer]. Points
 * are in metres: x to the person's left, y up, z to the front, as in glTF, the origin in the middle of the head. It holds no photo, but
 * a texture has the face's pixels. All functions may be called from any thread.
 */
class Head internal constructor(pointer: Long) : AutoCloseable {
    internal val handle = Handle(this, pointer, Native::maq_head_destroy)

    /** Where the size of a head comes from. */
    enum class Scale(internal val code: Int) {
        /** The average of heads: photos alone do not tell the size. */
        PRIOR(MAQ_HEAD_SCALE_PRIOR),

        /** A known distance. */
        GIVEN(MAQ_HEAD_SCALE_GIVEN),

        /** A depth camera. */
        DEPTH(MAQ_HEAD_SCALE_DEPTH),
    }

    /**
     * A description of a head.
     *
     * @property photos that it was fitted to.
     * @property scaleSigma standard deviation of its size, as a fraction of it: 0.04 is 4 %; 0: not known.
     * @property texturePx pixels a side; 0: it has no texture.
     */
    data class Info(val photos: Int, val scale: Scale, val scaleSigma: Double, val texturePx: Int)

    /**
     * A named point.
     *
     * @property sigmaM standard deviation of each coordinate, by shape model and photos. It is larger where no photo shows
     *   the point, and along the lines of sight. The deviation of the size comes on top.
     */
    data class Landmark(val point: Point3, val sigmaM: Double)

    /** Its description. */
    val info: Info

    /**
     * By their names. Of the shipped networks: nose_tip, nose_bridge, chin, crown, pupil_left, pupil_right, temple_left,
     * temple_right, ear_top_left, ear_top_right, ear_bottom_left and ear_bottom_right; left is the person's.
     */
    val landmarks: Map<String, Landmark>

    /**
     * Cameras of the photos that the head was fitted to ([HeadBuilder.Photo.isUsed]), in the order they were added.
     * [HeadRenderer.run] with one of them draws the head where the photo shows it.
     */
    val cameras: List<PinholeCamera>

    init {
        val i = handle.read(maq_head_info(), Native::maq_head_get_info)
        info = Info(i.photo_count, Scale.entries.first { it.code == i.scale }, i.scale_sigma.toDouble(), i.texture_px)
        landmarks =
            List(i.landmark_count) { index ->
                val name = textAt(handle.use { Native.maq_head_get_landmark_name(it, index) })
                val l = maq_head_landmark()
                handle.use { Native.maq_head_get_landmark(it, textOf(name), l) }
                name to Landmark(Point3.of(l.point_m), l.sigma_m.toDouble())
            }.toMap()
        cameras =
            List(info.photos) { index ->
                val camera = maq_pinhole_camera()
                handle.use { Native.maq_head_get_camera(it, index, camera) }
                PinholeCamera.of(camera)
            }
    }

    /**
     * Copies the head with the size at which two of its [landmarks] are [distanceM] apart (0.001 to 10), such as pupil_left
     * and pupil_right as an optician measured them.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (also: both are the same point) and [Status.NOT_FOUND] (it
     *   has no such landmark).
     */
    fun scaledByDistance(from: String, to: String, distanceM: Double): Head =
        handle.use { Head(Native.maq_head_scale_by_distance(it, textOf(from), textOf(to), distanceM)) }

    /**
     * Copies the head with the size at which it fits a depth image. Takes some 100 ms, so not on the main thread.
     *
     * @param depth of the view of the photo with this camera, in any size: a depth image, or an image with depth. Give that
     *   photo its focal length: an estimate that is 10 % too long makes the head 10 % too small.
     * @param camera its index in [cameras].
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (the index, no depth, another aspect ratio than the
     *   photo's) and [Status.NOT_FOUND] (half of the head has no depth that agrees with it).
     */
    fun scaledByDepth(depth: Frame, camera: Int = 0): Head =
        handle.use { head -> depth.handle.use { frame -> Head(Native.maq_head_scale_by_depth(head, camera, frame)) } }

    /**
     * Makes a mesh of its surface, which stays when the head is closed. Takes a second or less with the defaults, so not on
     * the main thread.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (the config), [Status.UNSUPPORTED] (the head has no surface,
     *   or the bundle no template), [Status.NOT_FOUND] and [Status.BAD_BUNDLE] (the template's bundle),
     *   [Status.OUT_OF_MEMORY].
     */
    fun mesh(config: HeadMesh.Config = HeadMesh.Config()): HeadMesh =
        handle.use { head -> HeadMesh(Native.maq_head_mesh_create(head, config.native())) }

    /**
     * Writes the head to a file (.maqh), some 64 KB and the texture, atomically, in a folder that exists. Blocks until it is
     * on the disk.
     *
     * @throws MaquetteException with [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { Native.maq_head_save(it, textOf(path)) }

    /** Its meshes and their renderers stay usable. */
    override fun close() = handle.close()
}
