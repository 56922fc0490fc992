package dev.maquette

import dev.maquette.jni.*
import java.nio.ByteBuffer
import java.nio.ByteOrder

/**
 * A photo with its camera, for [Maquette.denseCloud].
 *
 * @property photo of any format but depth; larger ones are scaled down to a long side of 960 pixels.
 * @property mask an image of the photo's size; no point is made of pixels where it is black. Null: of all pixels.
 */
class PosedPhoto(val photo: Frame, val camera: PinholeCamera, val mask: Frame? = null)

/**
 * A dense cloud, computed from posed photos and a sparse cloud. Made by [Maquette.denseCloud]. Functions may be called
 * from any thread.
 */
class DenseCloud internal constructor(
    context: Long,
    photos: List<PosedPhoto>,
    sparse: PointCloud,
    threads: Int,
    maxPoints: Long,
    progress: Progress?,
) : AutoCloseable {
    private val rgb = Memory(Long.SIZE_BYTES)
    private val native = maq_point_cloud()
    private val handle =
        Handle(
            this,
            create(context, photos, sparse, config(threads, maxPoints), progress),
            Native::maq_dense_cloud_destroy,
        )

    init {
        handle.use { Native.maq_dense_cloud_get_points(it, native, rgb) }
    }

    /** A copy of the points, ready for [Maquette.sceneBuilder]. */
    val points: PointCloud get() =
        PointCloud(copy(native.xyz, 3L * Float.SIZE_BYTES), native.point_count, native.origin, native.up)

    /** A copy of the points' colours: red, green and blue of each point. */
    val colours: ByteBuffer get() = copy(Pointer(rgb), 3L)

    /** A copy of the depth of a photo, 0 where it is unknown; and its camera, without distortion. */
    fun loadDepth(index: Int): Pair<Frame, PinholeCamera> {
        val camera = maq_pinhole_camera()
        val frame = Frame(handle.use { Native.maq_dense_cloud_load_depth(it, index, camera) })
        return Pair(frame, PinholeCamera.of(camera))
    }

    /** Frames of [loadDepth] stay valid. */
    override fun close() = handle.close()

    private fun copy(from: Pointer, bytesPerPoint: Long): ByteBuffer =
        handle.use {
            val bytes = from.bytes(bytesPerPoint * native.point_count)
            ByteBuffer.allocateDirect(bytes.capacity()).order(ByteOrder.nativeOrder()).put(bytes).also { it.clear() }
        }

    private companion object {
        fun config(threads: Int, maxPoints: Long) =
            maq_dense_cloud_config().also {
                it.threads = threads
                it.max_points = maxPoints
                it.progress_callback = Addresses.ofProgressCallback()
            }

        fun create(
            context: Long,
            photos: List<PosedPhoto>,
            sparse: PointCloud,
            config: maq_dense_cloud_config,
            progress: Progress?,
        ): Long {
            val structBytes = maq_posed_photo().sizeBytes
            val posed = Memory(structBytes * photos.size)
            val cloud = sparse.native()
            return withHandles(photos.flatMap { listOf(it.photo, it.mask) }) { frames ->
                photos.forEachIndexed { i, photo ->
                    val struct = maq_posed_photo(posed, structBytes * i)
                    struct.photo = frames[2 * i]
                    struct.mask = frames[2 * i + 1]
                    photo.camera.writeTo(struct.camera)
                }
                Callbacks.during(progress, discard = Native::maq_dense_cloud_destroy) {
                    Native.maq_dense_cloud_create(context, config, posed, photos.size, cloud)
                }
            }
        }

        /** Runs [work] with the native pointers of all frames, 0 for null, which stay valid meanwhile. */
        fun <T> withHandles(frames: List<Frame?>, pointers: List<Long> = emptyList(), work: (List<Long>) -> T): T {
            if (pointers.size == frames.size) return work(pointers)
            val frame = frames[pointers.size] ?: return withHandles(frames, pointers + 0L, work)
            return frame.handle.use { withHandles(frames, pointers + it, work) }
        }
    }
}
