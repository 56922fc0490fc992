package dev.maquette

import dev.maquette.jni.*
import java.nio.ByteBuffer
import java.nio.ByteOrder
import java.nio.FloatBuffer
import java.nio.IntBuffer

/**
 * The surface of a head, made by [Head.mesh]. It ends below the chin. The animatable head is open there, the dense surface
 * closed.
 *
 * Arrays are copied at the first use and stay valid after [close]. Buffers are direct and read-only, in native byte order,
 * each time with their own position: they can be given to OpenGL. Where there are texture coordinates, vertices at seams
 * appear twice.
 */
class HeadMesh internal constructor(pointer: Long) : AutoCloseable {
    internal val handle = Handle(this, pointer, Native::maq_head_mesh_destroy)

    /**
     * The default is an animatable head: the same vertices, triangles and texture coordinates for every head, with
     * eyeballs, teeth, tongue, facial actions and visemes, and joints in .glb files.
     *
     * @property triangleCount the dense, closed surface instead, with about this many triangles, 100 or more;
     *   [ALL_TRIANGLES]: all.
     * @property cellM also the dense surface, with this distance between neighbouring vertices before triangles are
     *   removed, 0.0005 to 0.02 metres; 0: 0.0021, or 0.0016 for more than 60,000 triangles.
     * @property bundle networks of heads with the template, for the animatable mesh of an opened head: its file has no
     *   template. A fitted head keeps the template of its builder.
     */
    data class Config(
        val triangleCount: Int = 0,
        val cellM: Double = 0.0,
        val bundle: ModelBundle? = null,
    ) {
        init {
            require(triangleCount >= ALL_TRIANGLES) { "The mesh has $triangleCount triangles; it needs 100 or more." }
        }

        internal fun native() =
            maq_head_mesh_config().also {
                bundle?.writeTo(it.model)
                it.triangle_count = triangleCount
                it.cell_m = cellM
            }

        companion object {
            /** For [triangleCount]. */
            const val ALL_TRIANGLES = MAQ_HEAD_ALL_TRIANGLES
        }
    }

    /**
     * A facial action or a viseme at its strongest: vertices go to position + weight * delta, with a weight of 0 to 1. The deltas of
     * several actions add up.
     *
     * @property name one of ARKit's 52 actions, such as jawOpen or eyeBlinkLeft; left is the person's left. Or one of 15
     *   visemes for speech, such as viseme_aa.
     * @property vertices the vertices that move, in increasing order.
     * @property deltasM x, y, z of each of them, in metres.
     */
    class MorphTarget internal constructor(val name: String, val vertices: IntArray, val deltasM: FloatArray)

    private class Arrays(
        val floats: List<ByteBuffer?>,
        val colours: ByteBuffer,
        val triangles: ByteBuffer,
        val textureJpeg: ByteArray?,
        val morphTargets: List<MorphTarget>,
        val simplificationErrorM: Float,
    )

    private val arrays: Arrays by lazy {
        handle.use { mesh ->
            val data = maq_head_mesh_data().also { Native.maq_head_mesh_get_data(mesh, it) }
            fun ofVertices(values: Pointer, bytes: Int) = copyOf(values.bytesOrNull(bytes.toLong() * data.vertex_count))
            val point = 3 * Float.SIZE_BYTES
            Arrays(
                floats = listOf(
                    ofVertices(data.positions_m, point),
                    ofVertices(data.normals, point),
                    ofVertices(data.template_points_m, point),
                    ofVertices(data.texture_coordinates, 2 * Float.SIZE_BYTES),
                ),
                colours = ofVertices(data.colours_rgb, 3)!!,
                triangles = copyOf(data.triangles.bytes(3L * Int.SIZE_BYTES * data.triangle_count))!!,
                textureJpeg =
                    data.texture_jpeg.bytesOrNull(data.texture_bytes.toLong())?.let { file ->
                        ByteArray(data.texture_bytes).also(file::get)
                    },
                morphTargets = List(data.morph_target_count) { index -> morphTargetOf(mesh, index) },
                simplificationErrorM = data.simplification_error_m,
            )
        }
    }

    private fun morphTargetOf(mesh: Long, index: Int): MorphTarget {
        val target = maq_head_morph_target().also { Native.maq_head_mesh_get_morph_target(mesh, index, it) }
        val vertices = target.vertices.ints(target.vertex_count)
        return MorphTarget(target.name.text(), vertices, target.deltas_m.floats(3 * vertices.size))
    }

    private fun copyOf(values: ByteBuffer?) = values?.let { native -> ByteBuffer.allocateDirect(native.capacity()).also { it.duplicate().put(native) } }

    val vertexCount: Int get() = arrays.colours.capacity() / 3
    val triangleCount: Int get() = arrays.triangles.capacity() / (3 * Int.SIZE_BYTES)

    /** The largest distance of a vertex of the full mesh from this one; 0 if nothing was removed. */
    val simplificationErrorM: Float get() = arrays.simplificationErrorM

    /** A square JPEG file, for `BitmapFactory`; null if the head has no texture. */
    val textureJpeg: ByteArray? get() = arrays.textureJpeg

    /** Facial actions and visemes of the animatable head; none of the dense surface. */
    val morphTargets: List<MorphTarget> get() = arrays.morphTargets

    /** x, y, z of each vertex, in metres. */
    val positions: FloatBuffer get() = floats(0)!!

    /** x, y, z of each vertex, outwards, of length 1. */
    val normals: FloatBuffer get() = floats(1)!!

    /**
     * x, y, z of each vertex, in metres: its point of the template head. Equal points mean the same part of every head, such
     * as the tip of the nose.
     */
    val templatePoints: FloatBuffer get() = floats(2)!!

    /** u to the right and v down of each vertex, 0 to 1; null of the dense surface without a texture. */
    val textureCoordinates: FloatBuffer? get() = floats(3)

    /** Red, green, blue of each vertex, sRGB. */
    val colours: ByteBuffer get() = arrays.colours.asReadOnlyBuffer()

    /** Three vertices of each triangle, counter-clockwise seen from outside. */
    val triangles: IntBuffer get() = arrays.triangles.asReadOnlyBuffer().order(ByteOrder.nativeOrder()).asIntBuffer()

    private fun floats(index: Int): FloatBuffer? =
        arrays.floats[index]?.asReadOnlyBuffer()?.order(ByteOrder.nativeOrder())?.asFloatBuffer()

    /**
     * Writes the mesh for other programs. The extension of [path] chooses the format: .glb, .obj with a .mtl beside it, or
     * .ply. GLB and OBJ have the texture, GLB also the morph targets. In files x is to the person's left, y up, z to the
     * front. Files appear atomically, in a folder that exists. Blocks while they are written.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension) and [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { Native.maq_head_mesh_save(it, textOf(path)) }

    /** Its renderers stay usable. */
    override fun close() = handle.close()
}
