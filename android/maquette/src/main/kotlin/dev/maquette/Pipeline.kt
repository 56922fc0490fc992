package dev.maquette

import dev.maquette.jni.NativePipeline
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
        Changes { state, status, problem -> Change(State.entries[state], Status.of(status), problem) }
            .also { it.tell(Change(State.STOPPED, Status.OK, "")) }
    private val handle =
        Handle(
            this,
            context.use {
                NativePipeline.create(it, config.source.values(), config.resultPoolSize, config.nice, stateChanges)
            },
            NativePipeline::destroy,
        )

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
    )

    /** What it does. */
    enum class State {
        /** It has no source: none was set yet, or [stop] was called. */
        STOPPED,

        /** The source is being opened. */
        OPENING,

        /** The networks are being loaded. */
        LOADING,

        /** Results are delivered. */
        RUNNING,

        /** By [setPaused]. */
        PAUSED,

        /** The camera sends no frames; it may recover by itself. */
        STALLED,

        /** The camera was lost; it is opened again if it comes back within [Source.Config.reconnectMs]. */
        RECONNECTING,

        /** The source has no more frames. */
        ENDED,

        /** The source or the networks cannot be used; [Info.problem] says why. */
        FAILED,
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
        get() {
            val codes = IntArray(2)
            val (problem, uri) = handle.use { NativePipeline.info(it, codes) }.map(ByteArray::decodeToString)
            return Info(State.entries[codes[0]], Status.of(codes[1]), problem, uri)
        }

    /** As it is now. */
    val stats: Stats
        get() {
            val s = handle.use(NativePipeline::stats)
            val quality = withModel(NativePipeline::quality)
            return Stats(
                s[0].toLong(), s[1].toLong(), s[2].toLong(), s[3], s[4], s[5], s[6].takeIf { it >= 0 },
                quality[0], quality[1],
            )
        }

    /**
     * Opens a source, as [Maquette.source] does, in place of the current one, of which no result is delivered after the
     * call. After [State.FAILED] everything is tried again. [info] and [changes] tell what went wrong.
     */
    @Synchronized
    fun setSource(uri: String) = handle.use { NativePipeline.setSource(it, uri.toByteArray()) }

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
        val pointer =
            context.use {
                NativePipeline.createModel(it, bundle.folder, bundle.names, bundle.buffers, config.values())
            }
        return Handle(this, pointer, NativePipeline::destroyModel).also { made ->
            made.use { NativePipeline.setFrameBudget(it, frameBudgetMs) }
            made.use { NativePipeline.setRoll(it, rollRad) }
        }
    }

    private fun run(next: Handle) = next.use { made -> handle.use { NativePipeline.setModel(it, made) } }

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
        withModel { NativePipeline.setRoll(it, rollRad) }
        this.rollRad = rollRad
    }

    /** Pauses or resumes. The current frame is finished first; the source stays open. */
    fun setPaused(isPaused: Boolean) = handle.use { NativePipeline.setPaused(it, isPaused) }

    /**
     * Records the frames that are processed from now on to a file (.maqrec, for the source `rec:`), which must not
     * exist yet. null, or the end or a change of the source, finishes the recording. If it fails, results go on, and [info]
     * has the reason.
     */
    fun setRecording(path: String?) = handle.use { NativePipeline.setRecording(it, path?.toByteArray()) }

    /** Closes the source; the networks stay loaded, and [setSource] starts again. A waiting [acquireResult] ends. */
    @Synchronized // so that the change to STOPPED does not follow one of a source that is set meanwhile
    fun stop() {
        handle.use(NativePipeline::stop)
        stateChanges.tell(Change(State.STOPPED, Status.OK, "")) // the library tells nothing after a stop
    }

    /** As [DensePose.surface]; null also before the networks are loaded. A result tells that they are. */
    fun surface(): BodySurface? = withModel(NativePipeline::surface)?.let(::BodySurface)

    /**
     * Takes the newest result that was not taken yet, or waits for the next: not on the main thread.
     *
     * @param timeoutMs milliseconds; negative: without limit.
     * @return null after the last frame, and while the pipeline is stopped, also by [close].
     * @throws MaquetteException with [Status.TIMEOUT]; [Status.POOL_EMPTY] while [Config.resultPoolSize] results are
     *   open; and with the status of [info] when the source or the networks cannot be used.
     */
    fun acquireResult(timeoutMs: Long = WAIT_FOREVER): PipelineResult? {
        val objects = LongArray(4)
        val times = DoubleArray(3)
        if (!handle.use { NativePipeline.acquire(it, nanoseconds(timeoutMs), objects, times) }) return null
        val (result, frame, densePose, number) = objects
        val openParts = AtomicInteger(2)
        val release = { _: Long -> if (openParts.decrementAndGet() == 0) NativePipeline.releaseResult(result) }
        return PipelineResult(
            Frame(frame, release), DensePoseResult(densePose, release), number, times[0], times[1],
            times[2].takeIf { it >= 0 },
        )
    }

    /**
     * Stops the pipeline and frees it. Blocks until the current run or loading of the networks is done: not on the main
     * thread. Results that are open stay valid.
     */
    override fun close() {
        handle.closeAfter(NativePipeline::stop)
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
