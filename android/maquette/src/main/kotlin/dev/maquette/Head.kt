package dev.maquette

import dev.maquette.jni.NativeHead

/**
 * A 3D head, coloured and in metres. Made by [HeadBuilder.fit] and [Maquette.openHead]; shown by a [HeadRenderer]. Points
 * are in metres: x to the person's left, y to the back of the head, z up, the origin in its middle. It holds no photo, but
 * a texture has the face's pixels. All functions may be called from any thread.
 */
class Head internal constructor(pointer: Long) : AutoCloseable {
    internal val handle = Handle(this, pointer, NativeHead::destroy)

    /** Where the size of a head comes from. */
    enum class Scale {
        /** The average of heads: photos alone do not tell the size. */
        PRIOR,

        /** A known distance. */
        GIVEN,

        /** A depth camera. */
        DEPTH,
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
     * Of the photos that it was fitted to ([HeadBuilder.Photo.isUsed]), in the order they were added: what
     * [HeadRenderer.run] draws with one of them lies on the head in the photo.
     */
    val cameras: List<PinholeCamera>

    init {
        val i = handle.use(NativeHead::info)
        info = Info(i[0].toInt(), Scale.entries[i[2].toInt()], i[3], i[4].toInt())
        landmarks =
            List(i[1].toInt()) { index ->
                val name = handle.use { NativeHead.landmarkName(it, index) }
                val l = handle.use { NativeHead.landmark(it, name) }
                name.decodeToString() to Landmark(Point3(l[0], l[1], l[2]), l[3])
            }.toMap()
        cameras = List(info.photos) { index -> PinholeCamera.of(handle.use { NativeHead.camera(it, index) }) }
    }

    /**
     * Copies the head with the size at which two of its [landmarks] are [distanceM] apart (0.001 to 10), such as pupil_left
     * and pupil_right as an optician measured them.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (also: both are the same point) and [Status.NOT_FOUND] (it
     *   has no such landmark).
     */
    fun scaledByDistance(from: String, to: String, distanceM: Double): Head =
        handle.use { Head(NativeHead.scaleByDistance(it, from.toByteArray(), to.toByteArray(), distanceM)) }

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
        handle.use { head -> depth.handle.use { frame -> Head(NativeHead.scaleByDepth(head, camera, frame)) } }

    /**
     * Makes a mesh of its surface, which stays when the head is closed. Takes a second or less with the defaults, so not on
     * the main thread.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (the config), [Status.UNSUPPORTED] (the head has no surface,
     *   or the bundle no template), [Status.NOT_FOUND] and [Status.BAD_BUNDLE] (the template's bundle),
     *   [Status.OUT_OF_MEMORY].
     */
    fun mesh(config: HeadMesh.Config = HeadMesh.Config()): HeadMesh =
        handle.use { head ->
            val bundle = config.bundle
            HeadMesh(NativeHead.createMesh(head, config.values(), bundle?.folder, bundle?.names, bundle?.buffers))
        }

    /**
     * Writes the head to a file (.maqh), some 64 KB and the texture, atomically, in a folder that exists. Blocks until it is
     * on the disk.
     *
     * @throws MaquetteException with [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { NativeHead.save(it, path.toByteArray()) }

    /** Its meshes and their renderers stay usable. */
    override fun close() = handle.close()
}
