package dev.maquette

import java.nio.ByteBuffer
import java.nio.ByteOrder
import java.nio.FloatBuffer
import java.nio.IntBuffer

/** Which vertices and triangles the mesh of a head has. */
enum class HeadTopology {
    /** Those of the surface as it is, closed. */
    FIELD,

    /**
     * Those of the template head, the same for every head, with texture coordinates, eyeballs, teeth and tongue, and morph
     * targets for facial actions; open at the neck. Hair, beards and glasses are as coarse as the skin is.
     */
    TEMPLATE,
}

/**
 * How fine the mesh of a head is, and of which vertices.
 *
 * @property triangleCount about as many, 100 or more; 0: 60,000, or with a [cellM] all; [ALL_TRIANGLES]: all.
 * @property cellM distance of neighbouring vertices of the full mesh, about, 0.0005 to 0.02 metres; 0: 0.0016, or 0.0021
 *     where no more than 60,000 triangles are to be left.
 * @property topology with [HeadTopology.TEMPLATE], [triangleCount] and [cellM] must be 0.
 * @property bundle networks of heads, whose template it is, for [HeadTopology.TEMPLATE] of a head that was opened: there is
 *   none in its file. A head that was fitted, or has got a template, keeps its own.
 */
data class HeadMeshOptions(
    val triangleCount: Int = 0,
    val cellM: Double = 0.0,
    val topology: HeadTopology = HeadTopology.FIELD,
    val bundle: ModelBundle? = null,
) {
    init {
        require(triangleCount >= ALL_TRIANGLES) { "The mesh has $triangleCount triangles; it needs 100 or more." }
    }

    internal fun values() = doubleArrayOf(triangleCount.toDouble(), cellM, topology.ordinal.toDouble())

    companion object {
        /** For [triangleCount]. */
        const val ALL_TRIANGLES = -1
    }
}

/**
 * The surface of a head, cut off below the chin, and closed but for [HeadTopology.TEMPLATE]. Made by [Head.mesh].
 *
 * Buffers are direct and read-only, in native byte order, each time with a position of their own: they can be given to
 * OpenGL as they are. Where there are texture coordinates, vertices at seams are there twice.
 *
 * @property simplificationErrorM the largest distance of a vertex of the full mesh from this one; 0 where it is full.
 * @property textureJpeg a JPEG file, square, for `BitmapFactory`; null where the head has no texture, and with
 *   [HeadTopology.TEMPLATE], whose coordinates are not of it.
 * @property morphTargets facial actions, with [HeadTopology.TEMPLATE]; else there are none.
 */
class HeadMesh private constructor(
    private val floats: List<ByteBuffer?>,
    private val colourBytes: ByteBuffer,
    private val indices: ByteBuffer,
    val simplificationErrorM: Float,
    val textureJpeg: ByteArray?,
    val morphTargets: List<MorphTarget>,
) {
    /**
     * How vertices move in a facial action at its strongest: to position + weight * move, with weights of 0 to 1, and the
     * sum of the moves where there are several actions.
     *
     * @property name one of ARKit's 52, such as jawOpen or eyeBlinkLeft; left is the person's.
     * @property vertices those that move, in increasing order.
     * @property movesM x, y, z of each of them, in metres.
     */
    class MorphTarget internal constructor(val name: String, val vertices: IntArray, val movesM: FloatArray)

    val vertexCount: Int = colourBytes.capacity() / 3
    val triangleCount: Int = indices.capacity() / (3 * Int.SIZE_BYTES)

    /** x, y, z of each vertex, in metres. */
    val positions: FloatBuffer get() = floats(0)!!

    /** x, y, z of each vertex, outwards, of length 1. */
    val normals: FloatBuffer get() = floats(1)!!

    /**
     * x, y, z of each vertex, in metres: where it lies on the template head, which is the same place (the tip of the nose,
     * say) on every head.
     */
    val templatePoints: FloatBuffer get() = floats(2)!!

    /** u to the right and v down of each vertex, 0 to 1; null without texture, but for [HeadTopology.TEMPLATE]. */
    val textureCoordinates: FloatBuffer? get() = floats(3)

    /** Red, green, blue of each vertex, sRGB. */
    val colours: ByteBuffer get() = colourBytes.asReadOnlyBuffer()

    /** Three vertices of each triangle, counter-clockwise seen from outside. */
    val triangles: IntBuffer get() = indices.asReadOnlyBuffer().order(ByteOrder.nativeOrder()).asIntBuffer()

    private fun floats(index: Int): FloatBuffer? =
        floats[index]?.asReadOnlyBuffer()?.order(ByteOrder.nativeOrder())?.asFloatBuffer()

    internal companion object {
        /** From what NativeHead.mesh gives. */
        fun of(arrays: Array<Any?>, simplificationErrorM: Float): HeadMesh {
            val (positions, normals, colours, templatePoints, triangles) = arrays
            val (coordinates, texture, targets) = arrays.drop(5)
            return HeadMesh(
                listOf(positions, normals, templatePoints, coordinates).map { it as ByteBuffer? },
                colours as ByteBuffer,
                triangles as ByteBuffer,
                simplificationErrorM,
                texture as ByteArray?,
                (targets as Array<*>).map { target ->
                    val (name, vertices, moves) = target as Array<*>
                    MorphTarget((name as ByteArray).decodeToString(), vertices as IntArray, moves as FloatArray)
                },
            )
        }
    }
}
