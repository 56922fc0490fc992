package dev.maquette

import dev.maquette.jni.*
import java.util.concurrent.atomic.AtomicBoolean

/**
 * Takes the frames of a stream and predicts later ones, to hide the delay between camera and screen. Made by
 * [Maquette.predictor].
 *
 * ```
 * predictor.push(frame)
 * predictor.predict(aheadS = 0.1).use { later -> show(later) }
 * ```
 *
 * Predicted frames are guesses: never steer anything by them. [Frame.origin] tells them from captured ones. Functions
 * may be called from any thread, one at a time: a call during another one throws [MaquetteException] with
 * [Status.INVALID_ARGUMENT]. [cancel] may be called at any time.
 */
class Predictor internal constructor(pointer: Long) : AutoCloseable {
    internal val handle = Handle(this, pointer, Native::maq_predictor_destroy)

    /** How frames are predicted. */
    enum class Method(internal val code: Int) {
        /**
         * Blends the last frame and the motion prediction per cell, weighted by their errors on past frames at the same
         * horizon. Equals the last frame while these errors are unknown and while nothing moves.
         */
        AUTO(MAQ_PREDICTOR_AUTO),

        /** Repeats the last frame. */
        LAST(MAQ_PREDICTOR_LAST),

        /** Moves everything on at the speed between the last two frames. */
        MOTION(MAQ_PREDICTOR_MOTION),

        /** Samples one possible future by a transformer. Slow. Needs a bundle; not for a [Concealer]. */
        SAMPLED(MAQ_PREDICTOR_SAMPLED),
    }

    /**
     * @property threads 0: the large cores, at most 4; else 1 to 64.
     * @property method [Method.SAMPLED] needs a bundle.
     * @property framePoolSize predicted frames that the app may hold at once, 1 to 64; 0: 4.
     * @property temperature of [Method.SAMPLED]: 0 takes the likeliest code; 1 samples by the probabilities.
     * @property seed of [Method.SAMPLED]: equal seeds give equal frames on one processor.
     */
    data class Config(
        val threads: Int = 0,
        val method: Method = Method.AUTO,
        val framePoolSize: Int = 4,
        val temperature: Float = 0f,
        val seed: Long = 0,
    ) {
        internal fun native(bundle: ModelBundle?) =
            maq_predictor_config().also {
                it.model.set(bundle, threads)
                it.method = method.code
                it.frame_pool_size = framePoolSize
                it.temperature = temperature
                it.seed = seed
            }
    }

    /**
     * Wall-clock milliseconds of the latest calls, and counts since the predictor was created.
     *
     * @property lumaMs of the push: the luma pyramid of the frame.
     * @property flowMs of the push: optical flow from the frame before.
     * @property weightsMs of the push: blend weights ([Method.AUTO], [Method.SAMPLED]).
     * @property pushMs of the push: total without networks.
     * @property projectMs of the prediction: the flow projected to the later time.
     * @property warpMs of the prediction: pixels warped along the flow.
     * @property predictMs of the prediction: total without networks.
     * @property networksMs of the latest push, prediction or [sample]; 0: none ran, as nothing moved.
     * @property method the method that made the latest prediction; [Method.LAST] or [Method.MOTION] if one of these made
     *   the whole frame of [Method.AUTO].
     * @property motionFraction the share of the motion prediction, 0 to 1, before networks changed it.
     * @property resetCount times that a frame did not continue the stream.
     * @property sampledFrameCount frames of all samples in the latest prediction or [sample].
     * @property stepCount decoding steps for these frames: one per cell, for all samples at once.
     */
    data class Stats(
        val lumaMs: Double,
        val flowMs: Double,
        val weightsMs: Double,
        val pushMs: Double,
        val projectMs: Double,
        val warpMs: Double,
        val predictMs: Double,
        val networksMs: Double,
        val method: Method,
        val motionFraction: Double,
        val pushedCount: Long,
        val predictedCount: Long,
        val resetCount: Long,
        val sampledFrameCount: Int,
        val stepCount: Int,
    )

    /**
     * Adds the stream's next frame. The frame is copied and may be closed. Motion is computed from timestamps, so frames
     * may be missing. Earlier frames are forgotten when this one has another size, format or clock, is not later, is
     * more than a second later, or shows another scene. A frame with the newest frame's timestamp replaces it. Takes
     * milliseconds, so not on the main thread.
     *
     * @throws MaquetteException with [Status.UNSUPPORTED] (a depth image).
     */
    fun push(frame: Frame) = handle.use { predictor -> frame.handle.use { Native.maq_predictor_push(predictor, it) } }

    /**
     * Predicts the frame [aheadS] seconds, 0 to 10, after the newest one, in the same size and format. Its timestamp is
     * that time; its sequence is the newest frame's. It comes from a pool: close it soon. Takes milliseconds, so not on
     * the main thread.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (also before the first frame), [Status.POOL_EMPTY] while
     *   [Config.framePoolSize] frames are open, and [Status.CANCELLED].
     */
    fun predict(aheadS: Double): Frame = Frame(handle.use { Native.maq_predictor_predict(it, aheadS) })

    /**
     * Samples [sampleCount], 1 to 16, possible futures of [frameCount], 1 to 64, frames that are [stepS], up to 0.125,
     * seconds apart. Results depend only on the seed and the pushed frames, not on the counts. All samples equal the
     * last frame while nothing moves. They are valid until the next push, prediction or sampling. Takes long, so not on
     * the main thread.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (also before the first frame), [Status.UNSUPPORTED] (the
     *   method is not [Method.SAMPLED]) and [Status.CANCELLED].
     */
    fun sample(sampleCount: Int, frameCount: Int, stepS: Double) =
        handle.use { Native.maq_predictor_sample(it, sampleCount, frameCount, stepS) }

    /** Cancels the sampling that runs, or else the next one: it throws [Status.CANCELLED]. Any thread. */
    fun cancel() = handle.use(Native::maq_predictor_cancel)

    /**
     * Decodes frame [frameIndex] (1-based) of sample [sampleIndex] (0-based). Otherwise like [predict].
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for a frame that was not sampled, and [Status.POOL_EMPTY].
     */
    fun acquireSample(sampleIndex: Int, frameIndex: Int): Frame =
        Frame(handle.use { Native.maq_predictor_acquire_sample(it, sampleIndex, frameIndex) })

    /**
     * Returns the mean entropy of a code of that frame in bits, for 16 x 16 cells row by row.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for a frame that was not sampled.
     */
    fun entropyMap(sampleIndex: Int, frameIndex: Int): FloatArray =
        handle.use { predictor ->
            val stats = maq_predictor_stats().also { Native.maq_predictor_get_stats(predictor, it) }
            val cells = maxOf(stats.cell_count, 1)
            val bits = Memory(4 * cells)
            Native.maq_predictor_copy_entropy_map(predictor, sampleIndex, frameIndex, bits, cells.toLong())
            bits.floats(0, cells).toFloatArray()
        }

    /** Forgets the frames so far, to begin another stream. */
    fun reset() = handle.use(Native::maq_predictor_reset)

    /** Times and counts at this moment. */
    val stats: Stats
        get() {
            val s = handle.read(maq_predictor_stats(), Native::maq_predictor_get_stats)
            return Stats(
                s.luma_ms, s.flow_ms, s.weights_ms, s.push_ms, s.project_ms, s.warp_ms, s.predict_ms, s.networks_ms,
                Method.entries.first { it.code == s.method }, s.motion_fraction.toDouble(), s.pushed_count,
                s.predicted_count, s.reset_count, s.sampled_frame_count, s.step_count,
            )
        }

    /** Its frames stay valid. */
    override fun close() = handle.close()
}

/**
 * Tells whether the camera of a stream is all right: it freezes, turns black, is covered or knocked. Needs no networks.
 * Made by [Maquette.cameraHealth].
 *
 * ```
 * val result = health.push(frame)
 * if (result.event != CameraHealth.Event.OK) tell(result.event)
 * ```
 *
 * Functions may be called from any thread, one at a time, as of a [Predictor].
 */
class CameraHealth internal constructor(
    context: Long,
) : AutoCloseable {
    private val handle = Handle(this, Native.maq_camera_health_create(context), Native::maq_camera_health_destroy)

    /** Events of a camera. */
    enum class Event(internal val code: Int) {
        /** Nothing. */
        OK(MAQ_CAMERA_OK),

        /** Another scene: the frames after it are not like those before. */
        CUT(MAQ_CAMERA_CUT),

        /** Frames are equal, byte for byte, for 0.3 s. */
        FREEZE(MAQ_CAMERA_FREEZE),

        /** The whole picture is black. */
        BLACK(MAQ_CAMERA_BLACK),

        /** A large part of the picture lost its detail at once, as by a hand, cloth or spray. */
        COVERED(MAQ_CAMERA_COVERED),

        /** The camera was knocked or turned: the picture jumped and then rests. */
        MOVED(MAQ_CAMERA_MOVED),

        /** Something is there at once that did not move into the picture. */
        OBJECT(MAQ_CAMERA_OBJECT),
        ;

        /** The event in one word, as the command line prints it. */
        val word: String get() = textAt(Native.maq_camera_event_get_name(code))
    }

    /**
     * The result for one frame.
     *
     * @property event found with this frame. CUT, COVERED, MOVED and OBJECT are found when the picture rests again: a cut
     *   mostly one frame after it began, the others five, at most 31.
     * @property state what lasts: [Event.FREEZE], [Event.BLACK] or [Event.COVERED], or [Event.OK].
     * @property beganNs of an event: the timestamp of its first frame.
     * @property xPx of an object: its middle. Of a move: how far the picture moved to the right. Otherwise 0.
     * @property yPx the same, from the top, and downward.
     * @property unexplained fraction of the frame that no motion from the frame before explains: 0 to 1.
     * @property isStreamStart the frame continues no stream: the first one, another size, format or clock, an earlier
     *   time, or more than a second later.
     * @property columns of the map.
     * @property rows of the map.
     * @property map how far motion leaves each cell unexplained, 0 to 1, [rows] rows of [columns] values from the top left.
     */
    class Result internal constructor(
        val event: Event,
        val state: Event,
        val beganNs: Long,
        val xPx: Float,
        val yPx: Float,
        val unexplained: Float,
        val isStreamStart: Boolean,
        val columns: Int,
        val rows: Int,
        val map: FloatArray,
    )

    /**
     * Wall-clock milliseconds of the latest frame, and counts since creation.
     */
    data class Stats(
        val pushMs: Double,
        val pushedCount: Long,
        val eventCount: Long,
        val streamStartCount: Long,
    )

    /**
     * Checks the stream's next frame, of any size and format except depth. The frame is not kept. Takes about a
     * millisecond. An error leaves the stream as it was before the frame.
     *
     * @throws MaquetteException with [Status.UNSUPPORTED] (a depth image).
     */
    fun push(frame: Frame): Result =
        handle.use { health ->
            val r = maq_camera_health_result()
            frame.handle.use { Native.maq_camera_health_push(health, it, r) }
            val cells = r.columns * r.rows
            val map = Memory(4 * maxOf(cells, 1))
            Native.maq_camera_health_copy_map(health, map, cells.toLong())
            fun eventOf(code: Int) = Event.entries.first { it.code == code }
            Result(
                eventOf(r.event), eventOf(r.state), r.began_ns, r.x_px, r.y_px, r.unexplained, r.is_stream_start != 0,
                r.columns, r.rows, map.floats(0, cells).toFloatArray(),
            )
        }

    /** Forgets the frames so far, to begin another stream. */
    fun reset() = handle.use(Native::maq_camera_health_reset)

    /** Times and counts at this moment. */
    val stats: Stats
        get() {
            val s = handle.read(maq_camera_health_stats(), Native::maq_camera_health_get_stats)
            return Stats(s.push_ms.toDouble(), s.pushed_count, s.event_count, s.stream_start_count)
        }

    override fun close() = handle.close()
}

/**
 * Delivers the frames of a live source at its rate. A frame that does not come in time is replaced by a predicted one.
 * Made by [Maquette.concealer].
 *
 * ```
 * maquette.concealer(source).use { concealer ->
 *     while (true) {
 *         val frame = concealer.acquireFrame() ?: break
 *         frame.use { show(it, isPredicted = it.origin != null) }
 *     }
 * }
 * ```
 *
 * An app that acts on its frames, such as a robot's, must check [Frame.origin] of every frame, or not use a concealer.
 * Gaps are filled from the sixth frame on. After [Config.maxGapMs] without a captured frame no more are predicted, and
 * calls return the source's own status. Functions may be called from any thread, but [acquireFrame] only one at a time;
 * [frames] gives the same as a flow.
 */
class Concealer internal constructor(context: Long, source: Source, config: Config) : AutoCloseable {
    // The garbage collector would stop a source that the app has forgotten.
    private val handle =
        handleThatKeeps(source, Native::maq_concealer_destroy) {
            source.handle.use { Native.maq_concealer_create(context, it, config.native()) }
        }
    private val isStopped = AtomicBoolean()

    /**
     * @property maxGapMs the longest gap that is filled, 1 to 10000; 0: 300.
     * @property threads as in [Predictor.Config].
     * @property method [Predictor.Method.AUTO], [Predictor.Method.LAST] or [Predictor.Method.MOTION].
     * @property framePoolSize frames that the app may hold at once, 1 to 64; 0: 3. The concealer itself holds one frame
     *   of the source's pool ([Source.Config.framePoolSize]).
     */
    data class Config(
        val maxGapMs: Int = 300,
        val threads: Int = 0,
        val method: Predictor.Method = Predictor.Method.AUTO,
        val framePoolSize: Int = 3,
    ) {
        internal fun native() =
            maq_concealer_config().also {
                it.max_gap_ms = maxGapMs
                it.threads = threads
                it.method = method.code
                it.frame_pool_size = framePoolSize
            }
    }

    /**
     * Counts, and wall-clock milliseconds.
     *
     * @property capturedCount captured frames that came in time.
     * @property predictedCount predicted frames.
     * @property lateCount captured frames that came after their predicted replacement: not delivered.
     * @property droppedCount frames that the app did not acquire in time.
     * @property latestGapMs length of the latest gap, up to [Config.maxGapMs].
     * @property latestWaitMs the latest predicted frame: time from when it was due until it was ready.
     * @property maxWaitMs the longest such time.
     */
    data class Stats(
        val capturedCount: Long,
        val predictedCount: Long,
        val lateCount: Long,
        val droppedCount: Long,
        val latestGapMs: Double,
        val latestWaitMs: Double,
        val maxWaitMs: Double,
    )

    /**
     * Waits for the next frame, captured or predicted; the newest one when several came since the latest call. The
     * timestamp of a predicted frame is the time that it shows; its sequence is the newest captured frame's. Timestamps
     * always increase.
     *
     * @param timeoutMs milliseconds; negative: without limit.
     * @return null after the source's last frame, and after [Source.stop], [Source.close] or [close], which end a call
     *   that waits.
     * @throws MaquetteException with [Status.TIMEOUT]; [Status.DEVICE_LOST]; [Status.POOL_EMPTY] while
     *   [Config.framePoolSize] frames are open; [Status.INVALID_ARGUMENT] while another thread acquires a frame.
     */
    fun acquireFrame(timeoutMs: Long = WAIT_FOREVER): Frame? {
        val beginNs = System.nanoTime()
        return handle.use { concealer ->
            while (!isStopped.get()) {
                // In the C API, only stopping the source ends a wait.
                val sinceBeginNs = System.nanoTime() - beginNs
                val leftNs =
                    if (timeoutMs < 0) SLICE_NS else (nanoseconds(timeoutMs) - sinceBeginNs).coerceIn(0, SLICE_NS)
                try {
                    return@use Frame(Native.maq_concealer_acquire_frame(concealer, leftNs))
                } catch (error: MaquetteException) {
                    when (error.status) {
                        Status.END_OF_STREAM, Status.CANCELLED -> return@use null
                        Status.TIMEOUT -> if (leftNs < SLICE_NS) throw timeout(timeoutMs)
                        else -> throw error
                    }
                }
            }
            null
        }
    }

    private fun timeout(timeoutMs: Long) = MaquetteException(Status.TIMEOUT, "No frame came within $timeoutMs ms.")

    /** Counts and times at this moment. */
    val stats: Stats
        get() {
            val s = handle.read(maq_concealer_stats(), Native::maq_concealer_get_stats)
            return Stats(
                s.captured_count, s.predicted_count, s.late_count, s.dropped_count, s.latest_gap_ms, s.latest_wait_ms,
                s.max_wait_ms,
            )
        }

    /** Gives the source's frames back to it. Frames that are open stay valid. Blocks for at most 50 ms. */
    override fun close() = handle.closeAfter { isStopped.set(true) }

    private companion object {
        /** The longest time that a wait delays closing. */
        const val SLICE_NS = 50_000_000L
    }
}
