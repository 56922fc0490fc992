package dev.maquette

import dev.maquette.jni.NativeHead

/**
 * A 3D head, coloured and in metres. Made by [HeadBuilder.fit] and [Maquette.openHead]; shown by a [HeadRenderer]. Points
 * are in metres: x to the person's left, y to the back of the head, z up, the origin in its middle. It holds no photo, but
 * a texture has the face's pixels. All functions may be called from any thread.
 */
class Head internal constructor(pointer: Long) : AutoCloseable {
    internal val handle = Handle(this, pointer, NativeHead::destroy)

    /** Where the size of a head is from. */
    enum class Scale {
        /** Heads are that large on average: photos alone do not tell. */
        PRIOR,

        /** A distance that was known. */
        GIVEN,

        /** A depth camera. */
        DEPTH,
    }

    /**
     * What a head has.
     *
     * @property photos that it was fitted to.
     * @property scaleSigma standard deviation of its size, as a fraction of it: 0.04 is 4 %; 0: not known.
     * @property texturePx pixels a side; 0: it has no texture.
     */
    data class Info(val photos: Int, val scale: Scale, val scaleSigma: Double, val texturePx: Int)

    /**
     * A place that has a name.
     *
     * @property sigmaM standard deviation of each coordinate that the shape model and the photos leave: more where they do
     *   not show it, or along their lines of sight; that of the size comes on top.
     */
    data class Landmark(val point: Point3, val sigmaM: Double)

    /** What it has. */
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
     * The same head, of the size at which two of its [landmarks] are [distanceM] apart (0.001 to 10), such as pupil_left
     * and pupil_right by what an optician measured.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (also where both are the same place) and
     *   [Status.NOT_FOUND] (it has no such place).
     */
    fun scaledByDistance(from: String, to: String, distanceM: Double): Head =
        useMesh { head -> Head(NativeHead.scaleByDistance(head, from.toByteArray(), to.toByteArray(), distanceM)) }

    /**
     * The same head, of the size at which it lies where a depth camera saw it. Takes some 100 ms, so not on the main thread.
     *
     * @param depth of the same view as the photo with this camera, in any size: depth itself, or a picture that came with
     *   depth. The photo should have been given its focal length: an estimated one that is 10 % too long makes the head as
     *   much too small.
     * @param camera its index in [cameras].
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (the index, no depth, another shape than the photo's) and
     *   [Status.NOT_FOUND] (half of the head has no depth that agrees with it).
     */
    fun scaledByDepth(depth: Frame, camera: Int = 0): Head =
        useMesh { head -> depth.handle.use { frame -> Head(NativeHead.scaleByDepth(head, camera, frame)) } }

    /**
     * Makes its surface as a mesh, which stays when the head is closed. Takes a second or less with the defaults, so not on
     * the main thread; the same again is quick.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (options), [Status.UNSUPPORTED] (it has no surface, or
     *   the bundle no template), [Status.NOT_FOUND] and [Status.BAD_BUNDLE] (of the template's bundle),
     *   [Status.OUT_OF_MEMORY].
     */
    fun mesh(options: HeadMeshOptions = HeadMeshOptions()): HeadMesh =
        useMesh { head ->
            val errorM = FloatArray(1)
            val bundle = options.bundle
            val arrays =
                NativeHead.mesh(head, options.values(), bundle?.folder, bundle?.names, bundle?.buffers, errorM)
            HeadMesh.of(arrays, errorM[0])
        }

    /**
     * Writes its mesh for other programs, by the ending of [path]: .glb, .obj with a .mtl beside it, or .ply; the first two
     * with the texture, the first with morph targets. In files x is to the person's left, y up, z to the front. Files
     * appear atomically, in a folder that exists. Blocks while the mesh is made and written.
     *
     * @throws MaquetteException as [mesh], and with [Status.INVALID_ARGUMENT] (another ending) and [Status.UNWRITABLE].
     */
    fun export(path: String, options: HeadMeshOptions = HeadMeshOptions()) =
        useMesh { head ->
            val bundle = options.bundle
            NativeHead.exportMesh(
                head, path.toByteArray(), options.values(), bundle?.folder, bundle?.names, bundle?.buffers,
            )
        }

    /**
     * Writes the head to a file (.maqh), some 64 KB and the texture, atomically, in a folder that exists. Blocks until it is
     * on the disk.
     *
     * @throws MaquetteException with [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { NativeHead.save(it, path.toByteArray()) }

    /** For what makes or uses the mesh that native code keeps: one at a time, since another one replaces it. */
    internal fun <T> useMesh(work: (Long) -> T): T = handle.use { synchronized(handle) { work(it) } }

    /** Meshes and renderers of it stay usable. */
    override fun close() = handle.close()
}
