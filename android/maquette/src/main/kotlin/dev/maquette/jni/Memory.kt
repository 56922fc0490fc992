package dev.maquette.jni

import dev.maquette.MaquetteException
import dev.maquette.Status
import java.nio.ByteBuffer
import java.nio.ByteOrder

/** Addresses of memory and of callbacks (src/main/cpp/jni_methods.cpp, jni_callbacks.cpp). */
internal object Addresses {
    init {
        Native // loads the library
    }

    /** The start of a direct buffer. */
    @JvmStatic external fun of(buffer: ByteBuffer): Long
    @JvmStatic external fun bytesAt(address: Long, sizeBytes: Long): ByteBuffer
    @JvmStatic external fun textAt(address: Long): ByteArray

    @JvmStatic external fun ofSourceCallback(): Long
    @JvmStatic external fun ofPipelineCallback(): Long
    @JvmStatic external fun ofProgressCallback(): Long
    @JvmStatic external fun ofPreviewCallback(): Long
    @JvmStatic external fun ofReleaseCallback(): Long
    @JvmStatic external fun ofLogCallback(): Long
}

/** The UTF-8 text at an address. */
internal fun textAt(address: Long): String = Addresses.textAt(address).decodeToString()

/** A copy of a text for the C API. */
internal fun textOf(text: String): Memory {
    val utf8 = text.toByteArray()
    if (0 in utf8) throw MaquetteException(Status.INVALID_ARGUMENT, "A text must not contain the character 0.")
    return Memory(utf8.size + 1).apply { bytes(0, utf8) }
}

/**
 * Native memory that a function of the C API reads or writes: a struct of Native.kt, a text, or numbers. It is filled with
 * zeros, which mean the default in each field. A function that gets it keeps it and the memory that it points to alive.
 */
internal open class Memory private constructor(
    private val buffer: ByteBuffer,
    private val base: Int,
    val sizeBytes: Int,
    @JvmField val address: Long,
    private val kept: MutableList<Memory>,
) {
    /** The memory of an app's direct buffer. */
    constructor(buffer: ByteBuffer) : this(buffer, 0, buffer.capacity(), Addresses.of(buffer), ArrayList(0))

    constructor(sizeBytes: Int) : this(ByteBuffer.allocateDirect(maxOf(sizeBytes, 1)).order(ByteOrder.nativeOrder()))

    private constructor(outer: Memory, at: Int, sizeBytes: Int) :
        this(outer.buffer, outer.base + at, sizeBytes, outer.address + at, outer.kept)

    /** New memory, or a part of [outer]. */
    constructor(sizeBytes: Int, outer: Memory?, at: Int) : this(outer ?: Memory(sizeBytes), at, sizeBytes)

    fun int(at: Int) = buffer.getInt(base + at)
    fun int(at: Int, value: Int) { buffer.putInt(base + at, value) }
    fun long(at: Int) = buffer.getLong(base + at)
    fun long(at: Int, value: Long) { buffer.putLong(base + at, value) }
    fun float(at: Int) = buffer.getFloat(base + at)
    fun float(at: Int, value: Float) { buffer.putFloat(base + at, value) }
    fun double(at: Int) = buffer.getDouble(base + at)
    fun double(at: Int, value: Double) { buffer.putDouble(base + at, value) }

    fun ints(at: Int, count: Int) = List(count) { int(at + 4 * it) }
    fun ints(at: Int, values: List<Int>) = values.forEachIndexed { i, value -> int(at + 4 * i, value) }
    fun longs(at: Int, count: Int) = List(count) { long(at + 8 * it) }
    fun longs(at: Int, values: List<Long>) = values.forEachIndexed { i, value -> long(at + 8 * i, value) }
    fun floats(at: Int, count: Int) = List(count) { float(at + 4 * it) }
    fun floats(at: Int, values: List<Float>) = values.forEachIndexed { i, value -> float(at + 4 * i, value) }
    fun doubles(at: Int, count: Int) = List(count) { double(at + 8 * it) }
    fun doubles(at: Int, values: List<Double>) = values.forEachIndexed { i, value -> double(at + 8 * i, value) }
    fun bytes(at: Int, count: Int) = ByteArray(count) { buffer.get(base + at + it) }
    fun bytes(at: Int, values: ByteArray) = values.forEachIndexed { i, value -> buffer.put(base + at + i, value) }
    fun text(at: Int, count: Int) = bytes(at, count).takeWhile { it != 0.toByte() }.toByteArray().decodeToString()
    fun pointers(at: Int, count: Int) = List(count) { Pointer(this, at + 8 * it) }

    /** Keeps [memory] as long as this. */
    fun keep(memory: Memory) {
        kept += memory
    }
}

/** A struct that begins with its size. */
internal abstract class Struct(sizeBytes: Int, outer: Memory?, at: Int) : Memory(sizeBytes, outer, at) {
    init {
        int(0, sizeBytes)
    }
}

/** A pointer in native memory. */
internal class Pointer(private val of: Memory, private val at: Int = 0) {
    val address: Long get() = of.long(at)

    /** Points to [memory], and keeps it. */
    fun set(memory: Memory?) {
        memory?.let(of::keep)
        of.long(at, memory?.address ?: 0)
    }

    fun text(): String = textAt(address)

    /** The memory that it points to, in native byte order; null of a null pointer. */
    fun bytesOrNull(sizeBytes: Long): ByteBuffer? =
        if (address == 0L) null else Addresses.bytesAt(address, sizeBytes).order(ByteOrder.nativeOrder())

    fun bytes(sizeBytes: Long): ByteBuffer = bytesOrNull(sizeBytes)!!

    // No numbers may lie nowhere.
    fun floats(count: Int) = FloatArray(count).also { if (count > 0) bytes(4L * count).asFloatBuffer().get(it) }

    fun ints(count: Int) = IntArray(count).also { if (count > 0) bytes(4L * count).asIntBuffer().get(it) }

    fun doubles(count: Int) = DoubleArray(count).also { if (count > 0) bytes(8L * count).asDoubleBuffer().get(it) }
}

/** Two numbers that [fill] writes. */
internal fun pairOf(fill: (first: Memory, second: Memory) -> Unit): List<Int> {
    val both = listOf(Memory(Int.SIZE_BYTES), Memory(Int.SIZE_BYTES))
    fill(both[0], both[1])
    return both.map { it.int(0) }
}

/** A plane of an image in native memory, read-only, [heightPx] rows of [rowBytes]; [get] writes its address and stride. */
internal fun planeOf(rowBytes: Int, heightPx: Int, get: (pixels: Memory, stride: Memory) -> Unit): ByteBuffer {
    val (pixels, stride) = List(2) { Memory(Long.SIZE_BYTES) }
    get(pixels, stride)
    check(stride.long(0) == rowBytes.toLong()) { "Rows of a plane have padding." }
    val plane = Pointer(pixels).bytes(stride.long(0) * heightPx)
    return plane.asReadOnlyBuffer().order(ByteOrder.nativeOrder())
}
