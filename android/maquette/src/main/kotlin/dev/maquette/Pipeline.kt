package dev.maquette

import dev.maquette.jni.*
import java.util.concurrent.atomic.AtomicInteger

/**
 * Runs a source and dense pose on a thread of the library, for apps that must not block. The newest frame is processed;
 * frames that come while the networks are busy are dropped. Made by [Maquette.pipeline]; stopped until [setSource].
 *
 * ```
 * pipeline.setSource("camera:")
 * pipeline.results().collect { result -> result.use { show(it.frame, it.densePose) } }
 * ```
 *
 * All functions may be called from any thread and, but for [acquireResult] and [close], do not block.
 */
class Pipeline internal constructor(private val context: Handle, bundle: ModelBundle, config: Config) : AutoCloseable {
    private val frameBudgetMs = config.frameBudgetMs

    @Volatile private var rollRad = 0f

    @Volatile private var model = modelOf(bundle, config.densePose)
    internal val stateChanges =
        Changes { state, status, problem -> Change(State.of(state), Status.of(status), problem) }
            .also { it.tell(Change(State.STOPPED, Status.OK, "")) }
    private val handle =
        handleThatKeeps(stateChanges, Native::maq_pipeline_destroy) { id ->
            val native = config.native()
            native.state_user_data = id
            context.use { Native.maq_pipeline_create(it, native) }
        }

    init {
        run(model)
    }

    /**
     * @property resultPoolSize results, with their frames, that the app may hold at once, 1 to 64.
     * @property densePose its [DensePose.Config.resultPoolSize] is not used.
     * @property source of all sources; its [Source.Config.framePoolSize] is not used.
     * @property nice added to the niceness of the threads of pipeline and networks, 0 to 19, so that drawing threads
     *   have priority.
     * @property frameBudgetMs what the networks may take for a frame, in the mean, as on a phone that throttles; 0: any
     *   time. When they take longer, people are detected in every second and then every fourth frame, then the input
     *   becomes smaller, down to half; both come back when there has been time for some seconds. [Stats] tells.
     */
    data class Config(
        val resultPoolSize: Int = 4,
        val densePose: DensePose.Config = DensePose.Config(),
        val source: Source.Config = Source.Config(),
        val nice: Int = 0,
        val frameBudgetMs: Double = 0.0,
    ) {
        internal fun native() =
            maq_pipeline_config().also {
                it.result_pool_size = resultPoolSize
                it.source.set(source.native())
                it.nice = nice
                it.state_callback = Addresses.ofPipelineCallback()
            }
    }

    /** The state of a pipeline. */
    enum class State(internal val code: Int) {
        /** It has no source: none was set yet, or [stop] was called. */
        STOPPED(MAQ_PIPELINE_STOPPED),

        /** The source is being opened. */
        OPENING(MAQ_PIPELINE_OPENING),

        /** The networks are being loaded. */
        LOADING(MAQ_PIPELINE_LOADING),

        /** Results are delivered. */
        RUNNING(MAQ_PIPELINE_RUNNING),

        /** By [setPaused]. */
        PAUSED(MAQ_PIPELINE_PAUSED),

        /** The camera sends no frames; it may recover by itself. */
        STALLED(MAQ_PIPELINE_STALLED),

        /** The camera was lost; it is opened again if it comes back within [Source.Config.reconnectMs]. */
        RECONNECTING(MAQ_PIPELINE_RECONNECTING),

        /** The source has no more frames. */
        ENDED(MAQ_PIPELINE_ENDED),

        /** The source or the networks cannot be used; [Info.problem] says why. */
        FAILED(MAQ_PIPELINE_FAILED),
        ;

        internal companion object {
            fun of(code: Int) = entries.first { it.code == code }
        }
    }

    /** A new state. [status] and [problem] are as in [Info], at that time. */
    data class Change(val state: State, val status: Status, val problem: String)

    /**
     * @property status [Status.OK], or why there are no results, or why the recording stopped.
     * @property problem the status in a sentence; "" with [Status.OK].
     * @property sourceUri as it was set; "" when none was set.
     */
    data class Info(val state: State, val status: Status, val problem: String, val sourceUri: String)

    /**
     * @property results made so far.
     * @property droppedResults of these: replaced by a newer one before they were taken, or made while the app held as
     *   many as it may.
     * @property droppedFrames of the current source: lost by the camera, or while the networks were busy.
     * @property resultsPerSecond over the last second.
     * @property waitMs of the latest result, as in [PipelineResult]; so are [runMs] and [ageMs].
     * @property keyFrameInterval in use, of the configuration or of [Config.frameBudgetMs]; 0 before the first result. So
     *   is [longSidePx].
     */
    data class Stats(
        val results: Long,
        val droppedResults: Long,
        val droppedFrames: Long,
        val resultsPerSecond: Double,
        val waitMs: Double,
        val runMs: Double,
        val ageMs: Double?,
        val keyFrameInterval: Int,
        val longSidePx: Int,
    )

    /** As it is now. */
    val info: Info
        get() =
            handle.use { pipeline ->
                val i = maq_pipeline_info().also { Native.maq_pipeline_get_info(pipeline, it) }
                Info(State.of(i.state), Status.of(i.status), i.problem.text(), i.source_uri.text())
            }

    /** As it is now. */
    val stats: Stats
        get() {
            val s = handle.read(maq_pipeline_stats(), Native::maq_pipeline_get_stats)
            val model = maq_densepose_model_stats()
            withModel { Native.maq_densepose_model_get_stats(it, model) }
            return Stats(
                s.result_count, s.dropped_result_count, s.dropped_frame_count, s.results_per_second, s.wait_ms,
                s.run_ms, s.age_ms.takeIf { it >= 0 }, model.key_frame_interval, model.long_side_px,
            )
        }

    /**
     * Opens a source, as [Maquette.source] does, in place of the current one, of which no result is delivered after the
     * call. After [State.FAILED] everything is tried again. [info] and [changes] tell what went wrong.
     */
    @Synchronized
    fun setSource(uri: String) = handle.use { Native.maq_pipeline_set_source(it, textOf(uri)) }

    /**
     * Loads networks in place of the current ones; the source stays open, and a photo that was processed is processed
     * again. [info] and [changes] tell what went wrong.
     *
     * @param config its [DensePose.Config.resultPoolSize] is not used.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for a value out of its range.
     */
    @Synchronized
    fun setDensePose(bundle: ModelBundle, config: DensePose.Config = DensePose.Config()) {
        val next = modelOf(bundle, config)
        run(next)
        model.close()
        model = next
    }

    private fun modelOf(bundle: ModelBundle, config: DensePose.Config): Handle {
        val pointer = context.use { Native.maq_densepose_model_create(it, config.native(bundle)) }
        return Handle(this, pointer, Native::maq_model_destroy).also { made ->
            made.use { Native.maq_densepose_model_set_frame_budget(it, frameBudgetMs) }
            made.use { Native.maq_densepose_model_set_roll(it, rollRad) }
        }
    }

    private fun run(next: Handle) = next.use { made -> handle.use { Native.maq_pipeline_set_model(it, made) } }

    private fun <T> withModel(work: (Long) -> T): T {
        while (true) {
            val current = model
            try {
                return current.use(work)
            } catch (error: IllegalStateException) {
                if (current === model) throw error // else it was replaced meanwhile
            }
        }
    }

    /** [DensePose.setRoll] for the next frames, whatever the source and the model. */
    fun setRoll(rollRad: Float) {
        withModel { Native.maq_densepose_model_set_roll(it, rollRad) }
        this.rollRad = rollRad
    }

    /** Pauses or resumes. The current frame is finished first; the source stays open. */
    fun setPaused(isPaused: Boolean) = handle.use { Native.maq_pipeline_set_paused(it, isPaused.toInt()) }

    /**
     * Records the frames that are processed from now on to a file (.maqrec, for the source `rec:`), which must not
     * exist yet. null, or the end or a change of the source, finishes the recording. If it fails, results go on, and [info]
     * has the reason.
     */
    fun setRecording(path: String?) = handle.use { Native.maq_pipeline_set_recording(it, path?.let(::textOf)) }

    /** Closes the source; the networks stay loaded, and [setSource] starts again. A waiting [acquireResult] ends. */
    @Synchronized // so that the change to STOPPED does not follow one of a source that is set meanwhile
    fun stop() {
        handle.use(Native::maq_pipeline_stop)
        stateChanges.tell(Change(State.STOPPED, Status.OK, "")) // the library tells nothing after a stop
    }

    /** As [DensePose.surface]; null also before the networks are loaded. A result tells that they are. */
    fun surface(): BodySurface? = 
        withModel { model -> BodySurface.of { Native.maq_densepose_model_get_surface(model, it) } }

    /**
     * Takes the newest result that was not taken yet, or waits for the next: not on the main thread.
     *
     * @param timeoutMs milliseconds; negative: without limit.
     * @return null after the last frame, and while the pipeline is stopped, also by [close].
     * @throws MaquetteException with [Status.TIMEOUT]; [Status.POOL_EMPTY] while [Config.resultPoolSize] results are
     *   open; and with the status of [info] when the source or the networks cannot be used.
     */
    fun acquireResult(timeoutMs: Long = WAIT_FOREVER): PipelineResult? {
        val result =
            orNull(Status.END_OF_STREAM, Status.CANCELLED) {
                handle.use { Native.maq_pipeline_acquire_result(it, nanoseconds(timeoutMs)) }
            } ?: return null
        val s = maq_pipeline_result_stats().also { Native.maq_pipeline_result_get_stats(result, it) }
        val openParts = AtomicInteger(2)
        val release = { _: Long -> if (openParts.decrementAndGet() == 0) Native.maq_pipeline_result_release(result) }
        return PipelineResult(
            Frame(Native.maq_pipeline_result_get_frame(result), release),
            DensePoseResult(Native.maq_pipeline_result_get_densepose(result), release),
            s.number, s.wait_ms, s.run_ms, s.age_ms.takeIf { it >= 0 },
        )
    }

    /**
     * Stops the pipeline and frees it. Blocks until the current run or loading of the networks is done: not on the main
     * thread. Results that are open stay valid.
     */
    override fun close() {
        handle.closeAfter(Native::maq_pipeline_stop)
        model.close()
        stateChanges.end()
    }
}

/**
 * A result with its frame. Closing it closes both; they may also be closed one by one.
 *
 * @property number counts the results of the pipeline, from 1; gaps are results that were dropped.
 * @property waitMs milliseconds that the pipeline waited for the frame.
 * @property runMs milliseconds that the networks took.
 * @property ageMs milliseconds from the capture of a camera's frame to the result; null if unknown.
 */
class PipelineResult internal constructor(
    val frame: Frame,
    val densePose: DensePoseResult,
    val number: Long,
    val waitMs: Double,
    val runMs: Double,
    val ageMs: Double?,
) : AutoCloseable {
    override fun close() {
        frame.close()
        densePose.close()
    }
}
