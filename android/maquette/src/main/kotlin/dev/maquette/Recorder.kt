package dev.maquette

import dev.maquette.jni.*

/**
 * Writes frames to a recording (.maqrec) with their times, depth and intrinsics; the source `rec:` plays it. Made by
 * [Maquette.recorder]. After a crash, every frame that was added can be read.
 *
 * ```
 * maquette.recorder(path, source).use { recorder ->
 *     repeat(300) { source.acquireFrame()?.use(recorder::add) }
 *     recorder.finish()
 * }
 * ```
 *
 * A [Pipeline] records what it processes by itself: [Pipeline.setRecording]. Functions may be called from any thread,
 * one at a time.
 */
class Recorder internal constructor(
    context: Long,
    path: String,
    source: Source?,
    jpegQuality: Int,
    keepPredicted: Boolean,
) : AutoCloseable {
    private val handle: Handle

    init {
        val native =
            maq_recorder_config().also {
                it.jpeg_quality = jpegQuality
                it.keep_predicted = keepPredicted.toInt()
            }
        fun create(source: Long) = Native.maq_recorder_create(context, textOf(path), source, native)
        val made = if (source == null) create(0) else source.handle.use(::create)
        handle = Handle(this, made, Native::maq_recorder_destroy)
    }

    /** Frames and bytes that have been written so far. */
    data class Info(val frameCount: Long, val sizeBytes: Long)

    /** As it is now. */
    val info: Info
        get() {
            val i = handle.read(maq_recorder_info(), Native::maq_recorder_get_info)
            return Info(i.frame_count, i.size_bytes)
        }

    /**
     * Adds a frame, which is complete in the file when the call returns. Frames may have different sizes and formats.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (not later than the frame before), [Status.UNSUPPORTED]
     *   (predicted, and such are not kept) and [Status.UNWRITABLE] (no space: earlier frames stay readable, and frames
     *   can be added again once there is some).
     */
    fun add(frame: Frame) = handle.use { recorder -> frame.handle.use { Native.maq_recorder_add_frame(recorder, it) } }

    /**
     * Writes the index, without which a player has to search for the frames. Blocks until the file is on the disk.
     *
     * @throws MaquetteException with [Status.UNWRITABLE].
     */
    fun finish() = handle.use(Native::maq_recorder_finish)

    /** Without [finish] before, the index is missing, and a file without a frame is removed. */
    override fun close() = handle.close()
}
