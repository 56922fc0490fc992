package dev.maquette

import dev.maquette.jni.*

/**
 * Fits a body, a mesh with a skeleton, to each person of dense pose. Made by [Maquette.body]. One call at a time; not on the
 * main thread.
 */
class Body internal constructor(pointer: Long) : AutoCloseable {
    internal val handle = Handle(this, pointer, Native::maq_body_destroy)

    /** @property resultPoolSize results that the app may hold at once, 1 to 64; 0: 4. */
    data class Config(val resultPoolSize: Int = 0) {
        internal fun native(bundle: ModelBundle) =
            maq_body_config().also {
                it.model.set(bundle)
                it.result_pool_size = resultPoolSize
            }
    }

    /**
     * The mesh and the skeleton that all bodies share.
     *
     * @property triangles three vertices each, counter-clockwise seen from outside.
     * @property jointNames "pelvis", "upper_arm.L" and others.
     * @property jointParents -1 of the first; parents come before their children.
     * @property shapeCount coefficients of a shape.
     */
    class Mesh internal constructor(native: maq_body_mesh) {
        val vertexCount = native.vertex_count
        val triangles: IntArray = native.triangles.ints(3 * native.triangle_count)
        val jointNames: List<String>
        val jointParents: List<Int> = native.joint_parents.ints(native.joint_count).toList()
        val shapeCount = native.shape_count

        init {
            val names = native.joint_names.bytes(8L * native.joint_count).asLongBuffer()
            jointNames = List(native.joint_count) { textAt(names[it]) }
        }
    }

    val mesh: Mesh = Mesh(handle.read(maq_body_mesh(), Native::maq_body_get_mesh))

    /**
     * Fits a body to each person of a result; also uses the keypoints, if it has them. A person starts from the body in the
     * frame before, if that was at most a second earlier. A time that goes back starts a new stream.
     *
     * @param intrinsics of the camera, for the frame's size. null: unknown, and all of a person is taken to be at one depth.
     * @param timestampNs of the frame.
     * @param heightsM true height of each person, 1.3 to 2.3 m, 0: unknown. One camera does not show how large a person is:
     *   mesh, place and sizes are those of a person of average height unless the height is given. null: all unknown.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (intrinsics of another size, a height out of its range) and
     *   [Status.POOL_EMPTY] while [Config.resultPoolSize] results are open.
     * @throws IllegalArgumentException for another number of heights.
     */
    fun run(
        people: DensePoseResult,
        intrinsics: Intrinsics? = null,
        timestampNs: Long = 0,
        heightsM: List<Float>? = null,
    ): BodyResult {
        val count = people.people.size
        require(heightsM == null || heightsM.size == count) {
            "There are ${heightsM?.size} heights, but $count people."
        }
        return people.handle.use {
            val input = maq_body_input()
            input.width_px = people.widthPx
            input.height_px = people.heightPx
            input.part.set(Memory(people.plane(DensePoseResult.Plane.PART)))
            input.u.set(Memory(people.plane(DensePoseResult.Plane.U)))
            input.v.set(Memory(people.plane(DensePoseResult.Plane.V)))
            input.person.set(Memory(people.plane(DensePoseResult.Plane.PERSON)))
            input.person_count = count
            input.ids.set(Memory(8 * count).apply { longs(0, people.people.map { it.id }) })
            val keypoints = people.people.flatMap { it.keypoints }
            if (keypoints.isNotEmpty()) {
                val flat = keypoints.flatMap { listOf(it.x, it.y, it.confidence) }
                input.keypoints.set(Memory(4 * flat.size).apply { floats(0, flat) })
            }
            input.intrinsics.set(intrinsics?.let { camera -> maq_intrinsics().also(camera::writeTo) })
            input.heights_m.set(heightsM?.let { heights -> Memory(4 * count).apply { floats(0, heights) } })
            input.timestamp_ns = timestampNs
            handle.use { body -> BodyResult(Native.maq_body_run(body, input), mesh) }
        }
    }

    /** The next frame starts a new stream. */
    fun reset() = handle.use(Native::maq_body_reset)

    /** Results and clips stay usable. */
    override fun close() = handle.close()
}

/** A size in metres; 90 % of people have a true size between [lowM] and [highM]. */
data class BodySize(val valueM: Float, val lowM: Float, val highM: Float) {
    internal companion object {
        fun of(native: maq_body_size) = BodySize(native.value_m, native.low_m, native.high_m)
    }
}

/**
 * Sizes of a body without clothes, standing upright; [chest], [waist] and [hip] are girths.
 *
 * @property isHeightKnown whether the height was given. false: all sizes have the wide intervals of an unknown scale.
 */
data class BodySizes(
    val isHeightKnown: Boolean,
    val height: BodySize,
    val chest: BodySize,
    val waist: BodySize,
    val hip: BodySize,
    val inseam: BodySize,
)

/**
 * The body of one person. Positions are in metres in axes of the camera (x right, y down, z forward), from the pelvis, three
 * numbers each.
 *
 * @property id of the dense pose result.
 * @property inlierFraction of the sampled pixels: those that agree with the pose, 0 to 1.
 * @property errorPx root mean square distance of these pixels from their points of the body.
 * @property pelvisM place of the pelvis in the camera; null without intrinsics.
 * @property pelvisPx pixel of the pelvis: x and y.
 * @property orientation rotation of the pelvis, row by row: body axes (x left, y back, z up) to camera axes.
 * @property anglesDeg see [Angle].
 * @property seenJoints whether the image shows the bones of each joint. Other joints follow the prior of poses.
 * @property shape in standard deviations, -3 to 3.
 * @property jointRotations rotation vectors relative to the parent in body axes, radians; 0 for the pelvis.
 * @property keypointsM the 33 keypoints, in the order of [Person.keypoints].
 */
class BodyPerson internal constructor(
    val id: Long,
    val inlierFraction: Float,
    val errorPx: Float,
    val iterations: Int,
    val pelvisM: List<Float>?,
    val pelvisPx: List<Float>,
    val scalePxPerM: Float,
    val orientation: List<Float>,
    val anglesDeg: Map<Angle, Float>,
    val seenJoints: List<Boolean>,
    val sizes: BodySizes,
    val shape: FloatArray,
    val jointRotations: FloatArray,
    val jointsM: FloatArray,
    val keypointsM: FloatArray,
    val verticesM: FloatArray,
) {
    /**
     * Angles of joints in degrees. Elbow and knee: 0 when straight. Hip and shoulder: direction of the limb in the sagittal
     * plane, 0 when it hangs down, 90 to the front, negative to the back.
     */
    enum class Angle(internal val code: Int) {
        LEFT_ELBOW(MAQ_BODY_ANGLE_LEFT_ELBOW),
        RIGHT_ELBOW(MAQ_BODY_ANGLE_RIGHT_ELBOW),
        LEFT_KNEE(MAQ_BODY_ANGLE_LEFT_KNEE),
        RIGHT_KNEE(MAQ_BODY_ANGLE_RIGHT_KNEE),
        LEFT_HIP(MAQ_BODY_ANGLE_LEFT_HIP),
        RIGHT_HIP(MAQ_BODY_ANGLE_RIGHT_HIP),
        LEFT_SHOULDER(MAQ_BODY_ANGLE_LEFT_SHOULDER),
        RIGHT_SHOULDER(MAQ_BODY_ANGLE_RIGHT_SHOULDER),
    }
}

/** The bodies of a frame. [people] are copies and stay when this is closed. */
class BodyResult internal constructor(pointer: Long, mesh: Body.Mesh) : AutoCloseable {
    internal val handle = Handle(this, pointer, Native::maq_body_result_release)

    /** The outcome for one person. */
    enum class Fit(internal val code: Int) {
        FITTED(MAQ_BODY_FIT_FITTED),

        /** The image shows too little of the person. */
        TOO_FEW_PIXELS(MAQ_BODY_FIT_TOO_FEW_PIXELS),

        /** Fewer than 40 % of the person's pixels agree with the best pose. */
        UNRELIABLE(MAQ_BODY_FIT_UNRELIABLE),
    }

    /** In the order of the dense pose result. */
    val fits: List<Fit>

    /** In the same order; null for a person who was not fitted. */
    val people: List<BodyPerson?>

    init {
        val natives =
            List(handle.use(Native::maq_body_result_get_person_count)) { index ->
                handle.read(maq_body_person()) { it, person -> Native.maq_body_result_get_person(it, index, person) }
            }
        fits = natives.map { person -> Fit.entries.first { it.code == person.fit } }
        people = natives.mapIndexed { index, person -> if (fits[index] == Fit.FITTED) personOf(index, person, mesh) else null }
    }

    private fun personOf(index: Int, p: maq_body_person, mesh: Body.Mesh): BodyPerson {
        val sizes = handle.read(maq_body_sizes()) { it, sizes -> Native.maq_body_result_get_sizes(it, index, sizes) }
        val joints = mesh.jointNames.size
        val angles = p.angles_deg
        return BodyPerson(
            p.id, p.inlier_fraction, p.error_px, p.iteration_count, p.pelvis_m.takeIf { p.is_metric != 0 }, p.pelvis_px,
            p.scale_px_per_m, p.orientation, BodyPerson.Angle.entries.associateWith { angles[it.code] },
            List(joints) { p.seen_joints shr it and 1 == 1 },
            BodySizes(
                sizes.is_height_known != 0, BodySize.of(sizes.height), BodySize.of(sizes.chest), BodySize.of(sizes.waist),
                BodySize.of(sizes.hip), BodySize.of(sizes.inseam),
            ),
            p.shape.floats(mesh.shapeCount), p.joint_rotations.floats(3 * joints), p.joints_m.floats(3 * joints),
            p.keypoints_m.floats(3 * MAQ_BODY_KEYPOINT_COUNT), p.vertices_m.floats(3 * mesh.vertexCount),
        )
    }

    override fun close() = handle.close()
}

/** The bodies of a clip, and their files. Made by `BodyClip(body)`. */
class BodyClip(body: Body) : AutoCloseable {
    private val handle = Handle(this, body.handle.use(Native::maq_body_clip_create), Native::maq_body_clip_destroy)

    val personCount: Int get() = handle.use(Native::maq_body_clip_get_person_count)

    /**
     * Adds the fitted people of a result of the same [Body]. A person without an id counts as a new one; one whose time is
     * not later than before is left out.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (a result of another body) and [Status.UNSUPPORTED] (more than
     *   1000 people).
     */
    fun add(result: BodyResult) =
        handle.use { clip -> result.handle.use { Native.maq_body_clip_add_result(clip, it) } }

    /**
     * Writes all people to one .glb file, animated if a person has several frames; atomically, in a folder that exists.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension), [Status.NOT_FOUND] (no people) and
     *   [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { Native.maq_body_clip_save(it, textOf(path)) }

    /**
     * Writes one person to a .glb or .bvh file; the one with the most frames has the index 0.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension, an index out of range) and
     *   [Status.UNWRITABLE].
     */
    fun savePerson(index: Int, path: String) =
        handle.use { Native.maq_body_clip_save_person(it, index, textOf(path)) }

    override fun close() = handle.close()
}
