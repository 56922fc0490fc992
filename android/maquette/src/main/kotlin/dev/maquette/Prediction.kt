package dev.maquette

import dev.maquette.jni.NativePrediction

/**
 * Gets the frames of a stream as they come, and makes pictures of what it will show a while later: to hide the time
 * that a picture takes from the camera to the screen. Made by [Maquette.predictor].
 *
 * ```
 * predictor.push(frame)
 * predictor.predict(aheadS = 0.1).use { coming -> show(coming) }
 * ```
 *
 * It sees pictures, not the world: never steer anything by what it made up. [Frame.origin] tells its frames from a
 * camera's. Functions may be called from any thread, one at a time; what comes while another runs throws
 * [MaquetteException] with [Status.INVALID_ARGUMENT].
 */
class Predictor internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, NativePrediction::destroyPredictor)

    /** How the coming picture is made. */
    enum class Method {
        /**
         * The others mixed, place by place, by how right each was there about the frames that have come, at that time
         * ahead; the last frame until that is known, and while nothing moves.
         */
        AUTO,

        /** The last frame, repeated. */
        LAST,

        /** Everything moves on as it moved between the last two frames. */
        MOTION,
    }

    /**
     * @property threads 0: the large cores, at most 4; else 1 to 64.
     * @property framePoolSize predicted frames that the app may hold at once, 1 to 64.
     */
    data class Config(
        val threads: Int = 0,
        val method: Method = Method.AUTO,
        val framePoolSize: Int = 4,
    ) {
        internal fun values() =
            doubleArrayOf(threads.toDouble(), method.ordinal.toDouble(), framePoolSize.toDouble())
    }

    /**
     * How samples of coming frames are drawn, by a predictor that was made with networks.
     *
     * @property temperature 1 draws by the probabilities, 0 takes the likeliest.
     * @property topK only so many of the likeliest of each code; 0: all.
     * @property seed equal seeds draw the same.
     * @property passes 0: exactly by the probabilities; 1 to 16: all places of a frame at once, at most so many times.
     */
    data class Sampling(
        val temperature: Float = 1f,
        val topK: Int = 0,
        val seed: Long = 0,
        val passes: Int = 0,
    ) {
        internal fun values() = doubleArrayOf(temperature.toDouble(), topK.toDouble(), passes.toDouble())
    }

    /**
     * Wall-clock milliseconds of the latest push and prediction, and counts since the predictor was made.
     *
     * @property greyMs of the push: the frame copied, and its brightness at several sizes.
     * @property flowMs its motion since the frame before.
     * @property choiceMs which method was right about it ([Method.AUTO]).
     * @property pushMs all of it.
     * @property projectMs of the prediction: where each pixel comes from.
     * @property fetchMs its pixels.
     * @property predictMs all of it.
     * @property method of the latest prediction: [Method.LAST] or [Method.MOTION] where one made all of it.
     * @property motionFraction how much of it is motion's, 0 to 1.
     * @property resetCount frames that did not go on from the one before, so that it was forgotten.
     * @property networksMs of networks at the latest push, prediction or [draw]; 0 where nothing moved.
     * @property drawnCount frames drawn for the latest prediction or [draw].
     * @property stepCount of that: steps from code to code, each of all samples, 256 a frame; 0 where nothing moved.
     * @property passCount of that: passes over all codes of a frame at once, with [Sampling.passes].
     */
    data class Stats(
        val greyMs: Double,
        val flowMs: Double,
        val choiceMs: Double,
        val pushMs: Double,
        val projectMs: Double,
        val fetchMs: Double,
        val predictMs: Double,
        val method: Method,
        val motionFraction: Double,
        val pushedCount: Long,
        val predictedCount: Long,
        val resetCount: Long,
        val networksMs: Double,
        val drawnCount: Int,
        val stepCount: Int,
        val passCount: Int,
    )

    /**
     * Shows it the stream's next frame, which is copied, and may be closed. Time counts by the frames' timestamps, so
     * that frames may be missing. The frames before are forgotten where this one is of another size, format or clock,
     * not later than they are or more than a second later, or after a cut; one of the same time as the frame before
     * replaces it. Takes milliseconds, so not on the main thread.
     *
     * @throws MaquetteException with [Status.UNSUPPORTED] (a depth image).
     */
    fun push(frame: Frame) =
        handle.use { predictor -> frame.handle.use { NativePrediction.pushToPredictor(predictor, it) } }

    /**
     * The picture that the stream will show [aheadS] seconds, 0 to 10, after the latest frame: of that frame's size and
     * format, with that time as its timestamp and that frame's sequence. It comes from a pool: close it soon. Takes
     * milliseconds, so not on the main thread.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (also before the first frame) and [Status.POOL_EMPTY]
     *   while [Config.framePoolSize] frames are open.
     */
    fun predict(aheadS: Double): Frame = Frame(handle.use { NativePrediction.predict(it, aheadS) })

    /**
     * Draws [samples], 1 to 16, of what the stream may show, each [frames], 1 to 64, that are [stepS], to 0.125, apart.
     * A sample is the same however many others are drawn. While nothing moves all are the last frame. [drawn] and
     * [uncertainty] give them until the next push, prediction or draw. Takes long, so not on the main thread.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (also before the first frame) and [Status.UNSUPPORTED]
     *   (a predictor without networks).
     */
    fun draw(samples: Int, frames: Int, stepS: Double) =
        handle.use { NativePrediction.draw(it, samples, frames, stepS) }

    /**
     * The picture of frame [number], from 1, of a sample, from 0; all else as of [predict].
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for one that was not drawn, and [Status.POOL_EMPTY].
     */
    fun drawn(sample: Int, number: Int): Frame = Frame(handle.use { NativePrediction.drawn(it, sample, number) })

    /**
     * How uncertain that frame was when it was drawn: the entropy of a code in bits, of 16 x 16 cells row by row.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] for one that was not drawn.
     */
    fun uncertainty(sample: Int, number: Int): FloatArray =
        handle.use { NativePrediction.uncertainty(it, sample, number) }

    /** Forgets the frames so far, as before another stream. */
    fun reset() = handle.use(NativePrediction::resetPredictor)

    /** As it is now. */
    val stats: Stats
        get() {
            val s = handle.use(NativePrediction::statsOfPredictor)
            return Stats(
                s[0], s[1], s[2], s[3], s[4], s[5], s[6], Method.entries[s[7].toInt()], s[8], s[9].toLong(),
                s[10].toLong(), s[11].toLong(), s[12], s[13].toInt(), s[14].toInt(), s[15].toInt(),
            )
        }

    /** Frames that it made stay valid. */
    override fun close() = handle.close()
}

/**
 * How surprising each frame of a stream is after the one before, and where, in bits: to notice what stands out, such as
 * a cut, a frozen or a covered camera, or something that appears, without a list of what may happen. Made by
 * [Maquette.surprise].
 *
 * ```
 * val score = surprise.push(frame)
 * if (score.isEvent) show(score.ratio)
 * ```
 *
 * Functions may be called from any thread, one at a time, as of a [Predictor].
 */
class Surprise internal constructor(
    context: Long,
    bundle: ModelBundle?,
    config: Config,
    networksOf: Surprise?,
) : AutoCloseable {
    private val handle: Handle

    init {
        fun create(other: Long) =
            NativePrediction.createSurprise(
                context,
                bundle?.folder,
                bundle?.names,
                bundle?.buffers,
                config.values(),
                other,
            )
        val made = if (networksOf == null) create(0) else networksOf.handle.use(::create)
        handle = Handle(this, made, NativePrediction::destroySurprise)
    }

    /**
     * @property threads as of [DensePose.Config].
     * @property allowSpinning as of [DensePose.Config].
     * @property eventRatio a frame is an event from this ratio on, and from 1 / it down; above 1, at most 1e6.
     * @property usesTable a table says how likely codes are, which takes next to no time, also where the bundle has a
     *   transformer, which sees three frames before.
     */
    data class Config(
        val threads: Int = 0,
        val allowSpinning: Boolean = false,
        val eventRatio: Float = 4f,
        val usesTable: Boolean = false,
    ) {
        internal fun values() =
            doubleArrayOf(
                threads.toDouble(),
                if (allowSpinning) 1.0 else 0.0,
                eventRatio.toDouble(),
                if (usesTable) 1.0 else 0.0,
            )
    }

    /**
     * Of one frame.
     *
     * @property bits a code, mean of the frame: some hundredths where nothing changes, 1 to 3 where much moves, over 8
     *   where nothing was foreseen.
     * @property ratio bits by the median of the 8 frames before: 1 is as usual, 6 six times as surprising, 1/6 a sixth,
     *   as of a stream that freezes. 1 while fewer than 4 are known.
     * @property isEvent it is a cut, or the ratio is [Config.eventRatio] or more, or 1 / that or less.
     * @property isCut nothing in it follows from the frame before, as at a cut or a black-out.
     * @property isStart it does not go on from the frame before, and bits say how rare its codes are: the first;
     *   another size, format or clock; an earlier time; over a second later.
     * @property columns of the map.
     * @property rows of the map.
     * @property map bits of a code, mean of the cell, [rows] rows of [columns] values from the top left. A cell is that
     *   part of the frame, whatever the frame's shape.
     */
    class Score internal constructor(
        val bits: Float,
        val ratio: Float,
        val isEvent: Boolean,
        val isCut: Boolean,
        val isStart: Boolean,
        val columns: Int,
        val rows: Int,
        val map: FloatArray,
    )

    /**
     * Wall-clock milliseconds of the latest frame, and counts since it was made.
     *
     * @property resizeMs the frame to the network's square.
     * @property nearestMs codes of what the network says.
     * @property pushMs all of it, and the bits.
     * @property threads of the network.
     * @property transformerMs how likely its codes are; 0 where the table said that.
     */
    data class Stats(
        val resizeMs: Double,
        val networkMs: Double,
        val nearestMs: Double,
        val pushMs: Double,
        val threads: Int,
        val pushedCount: Long,
        val eventCount: Long,
        val startCount: Long,
        val transformerMs: Double,
    )

    /**
     * Shows it the stream's next frame, of any size and format but depth, which is not kept. Takes milliseconds, so not
     * on the main thread. After an error the stream is as it was before the frame.
     *
     * @throws MaquetteException with [Status.UNSUPPORTED] (a depth image) and [Status.INFERENCE].
     */
    fun push(frame: Frame): Score {
        val s = handle.use { surprise -> frame.handle.use { NativePrediction.pushToSurprise(surprise, it) } }
        val map = s.copyOfRange(SCALARS, s.size)
        return Score(s[2], s[3], s[4] != 0f, s[5] != 0f, s[6] != 0f, s[0].toInt(), s[1].toInt(), map)
    }

    /**
     * What the network saw of the latest frame: what is not in it cannot be surprising. A small square in RGB, whatever
     * the frame's shape, with the frame's time; its [Frame.origin] has a horizon of 0. From a pool of 4: close it soon.
     * The first call takes longer.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] before the first frame, [Status.POOL_EMPTY],
     *   [Status.BAD_BUNDLE] and [Status.INFERENCE].
     */
    fun rebuilt(): Frame = Frame(handle.use(NativePrediction::rebuilt))

    /** Forgets the frames so far, as before another stream. */
    fun reset() = handle.use(NativePrediction::resetSurprise)

    /** As it is now. */
    val stats: Stats
        get() {
            val s = handle.use(NativePrediction::statsOfSurprise)
            return Stats(s[0], s[1], s[2], s[3], s[4].toInt(), s[5].toLong(), s[6].toLong(), s[7].toLong(), s[8])
        }

    /** Pictures that it made, and streams with its networks, stay valid. */
    override fun close() = handle.close()

    private companion object {
        const val SCALARS = 7
    }
}

/**
 * The frames of a live source at its rate: one that is not there when it is due is replaced by one that was predicted
 * before. Made by [Maquette.concealer].
 *
 * ```
 * maquette.concealer(source).use { concealer ->
 *     while (true) {
 *         val frame = concealer.acquireFrame() ?: break
 *         frame.use { show(it, isMadeUp = it.origin != null) }
 *     }
 * }
 * ```
 *
 * An app that acts on what it sees, such as a robot's, must look at [Frame.origin] of every frame, or not use a
 * concealer. Gaps are bridged from the sixth frame on. When the camera has sent nothing for [Config.maxGapMs], there
 * are no more predicted frames, and calls return what the source's own would. Functions may be called from any thread,
 * but [acquireFrame] only one at a time; [frames] gives the same as a flow.
 */
class Concealer internal constructor(context: Long, source: Source, config: Config) : AutoCloseable {
    private val handle =
        Handle(
            this,
            source.handle.use { NativePrediction.createConcealer(context, it, source, config.values()) },
            NativePrediction::destroyConcealer,
        )

    /**
     * @property maxGapMs how far ahead frames are predicted, 1 to 10000.
     * @property threads as of [Predictor.Config].
     * @property framePoolSize frames that the app may hold at once, 1 to 64. The concealer itself holds one of the
     *   source's ([Source.Config.framePoolSize]).
     */
    data class Config(
        val maxGapMs: Int = 300,
        val threads: Int = 0,
        val method: Predictor.Method = Predictor.Method.AUTO,
        val framePoolSize: Int = 3,
    ) {
        internal fun values() =
            doubleArrayOf(
                maxGapMs.toDouble(),
                threads.toDouble(),
                method.ordinal.toDouble(),
                framePoolSize.toDouble(),
            )
    }

    /**
     * @property capturedCount frames of the source that were there in time.
     * @property predictedCount frames made up in place of others.
     * @property lateCount frames of the source that came after a predicted one had stood for them: not delivered.
     * @property droppedCount frames that the app did not acquire in time.
     * @property latestGapMs the latest gap, as far as it was bridged.
     * @property latestWaitMs the latest predicted frame: from when it was due until it was there.
     * @property maxWaitMs the longest of these.
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
     * Waits for the next frame, captured or predicted; the newest, where several have come since the last call. A
     * predicted one has the time that it stands for as its timestamp, and the sequence of the captured frame that it
     * was made from. Timestamps grow from frame to frame.
     *
     * @param timeoutMs milliseconds; negative: without limit.
     * @return null after the source's last frame, and after [Source.stop], [Source.close] or [close], which end a call
     *   that waits.
     * @throws MaquetteException with [Status.TIMEOUT]; [Status.DEVICE_LOST]; [Status.POOL_EMPTY] while
     *   [Config.framePoolSize] frames are open; [Status.INVALID_ARGUMENT] while another thread acquires a frame.
     */
    fun acquireFrame(timeoutMs: Long = WAIT_FOREVER): Frame? {
        val frame = handle.use { NativePrediction.acquireFromConcealer(it, nanoseconds(timeoutMs)) }
        return if (frame == 0L) null else Frame(frame)
    }

    /** As it is now. */
    val stats: Stats
        get() {
            val s = handle.use(NativePrediction::statsOfConcealer)
            return Stats(s[0].toLong(), s[1].toLong(), s[2].toLong(), s[3].toLong(), s[4], s[5], s[6])
        }

    /** Gives the source's frames back to it. Frames that are open stay valid. Blocks for at most 50 ms. */
    override fun close() = handle.closeAfter(NativePrediction::stopConcealer)
}
