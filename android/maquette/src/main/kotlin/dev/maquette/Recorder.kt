package dev.maquette

import dev.maquette.jni.NativeSource

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
        fun create(source: Long) =
            NativeSource.createRecorder(context, path.toByteArray(), source, jpegQuality, keepPredicted)
        val made = if (source == null) create(0) else source.handle.use(::create)
        handle = Handle(this, made, NativeSource::destroyRecorder)
    }

    /** What has been written so far. */
    data class Info(val frameCount: Long, val sizeBytes: Long)

    /** As it is now. */
    val info: Info
        get() {
            val (frames, bytes) = handle.use(NativeSource::recorderInfo)
            return Info(frames.toLong(), bytes.toLong())
        }

    /**
     * Adds a frame, which is complete in the file when the call returns. Frames may have different sizes and formats.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (not later than the frame before), [Status.UNSUPPORTED]
     *   (predicted, and such are not kept) and [Status.UNWRITABLE] (no space: earlier frames stay readable, and frames
     *   can be added again once there is some).
     */
    fun add(frame: Frame) = handle.use { recorder -> frame.handle.use { NativeSource.record(recorder, it) } }

    /**
     * Writes the index, without which a player has to search for the frames. Blocks until the file is on the disk.
     *
     * @throws MaquetteException with [Status.UNWRITABLE].
     */
    fun finish() = handle.use(NativeSource::finishRecorder)

    /** Without [finish] before, the index is missing, and a file without a frame is removed. */
    override fun close() = handle.close()
}
