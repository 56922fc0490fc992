package dev.maquette.jni

import dev.maquette.HeadCallbacks
import java.nio.ByteBuffer

/** The C API's heads, as [Native]. */
internal object NativeHead {
    init {
        System.loadLibrary("maquette_jni")
    }

    @JvmStatic
    external fun createBuilder(
        context: Long,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
        values: DoubleArray,
    ): Long

    @JvmStatic external fun destroyBuilder(builder: Long)

    /** [hints]: left, top, right and bottom of the box, roll, focal length; 0 if unknown. */
    @JvmStatic external fun addPhoto(builder: Long, photo: Long, hints: FloatArray)

    @JvmStatic external fun addHead(builder: Long, head: Long)

    @JvmStatic external fun clear(builder: Long)
    @JvmStatic external fun cancel(builder: Long)

    @JvmStatic
    external fun fit(
        builder: Long,
        seconds: Double,
        callbacks: HeadCallbacks,
        hasPreview: Boolean,
        previewIntervalS: Double,
    ): Long

    @JvmStatic external fun photo(builder: Long, index: Int): FloatArray
    @JvmStatic external fun builderStats(builder: Long): DoubleArray

    @JvmStatic external fun open(context: Long, path: ByteArray): Long
    @JvmStatic external fun openMemory(context: Long, file: ByteBuffer): Long
    @JvmStatic external fun scaleByDistance(head: Long, from: ByteArray, to: ByteArray, distanceM: Double): Long
    @JvmStatic external fun scaleByDepth(head: Long, camera: Int, frame: Long): Long
    @JvmStatic external fun destroy(head: Long)
    @JvmStatic external fun save(head: Long, path: ByteArray)
    @JvmStatic external fun info(head: Long): DoubleArray
    @JvmStatic external fun landmarkName(head: Long, index: Int): ByteArray
    @JvmStatic external fun landmark(head: Long, name: ByteArray): DoubleArray
    @JvmStatic external fun camera(head: Long, index: Int): DoubleArray

    @JvmStatic
    external fun createMesh(
        head: Long,
        values: DoubleArray,
        folder: ByteArray?,
        names: Array<ByteArray>?,
        buffers: Array<ByteBuffer>?,
    ): Long

    @JvmStatic external fun destroyMesh(mesh: Long)
    @JvmStatic external fun saveMesh(mesh: Long, path: ByteArray)

    /**
     * Direct buffers with positions, normals, colours, template points, triangles and texture coordinates (or null); the
     * texture's file (or null); for each morph target name, vertices and deltas. Writes the simplification error.
     */
    @JvmStatic external fun meshArrays(mesh: Long, errorM: FloatArray): Array<Any?>

    @JvmStatic external fun createRenderer(context: Long, mesh: Long, values: DoubleArray): Long
    @JvmStatic external fun destroyRenderer(renderer: Long)

    @JvmStatic
    external fun orbitCamera(
        renderer: Long,
        yawRad: Double,
        pitchRad: Double,
        widthPx: Int,
        heightPx: Int,
    ): DoubleArray

    @JvmStatic external fun setShading(renderer: Long, shading: Int)
    @JvmStatic external fun render(renderer: Long, camera: DoubleArray): Long
}
