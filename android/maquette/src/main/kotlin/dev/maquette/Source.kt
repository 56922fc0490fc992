package dev.maquette

import dev.maquette.jni.*

/** A timeout without limit. */
const val WAIT_FOREVER: Long = MAQ_WAIT_FOREVER.toLong()

/** A negative timeout is without limit. */
internal fun nanoseconds(timeoutMs: Long): Long =
    if (timeoutMs < 0) WAIT_FOREVER else minOf(timeoutMs, Long.MAX_VALUE / 1_000_000) * 1_000_000

/**
 * A camera, a file, a recording or a stub that delivers frames. Made by [Maquette.source].
 *
 * ```
 * maquette.source("video:/sdcard/clip.mp4").use { source ->
 *     while (true) {
 *         val frame = source.acquireFrame() ?: break
 *         frame.use { show(it) }
 *     }
 * }
 * ```
 *
 * [frames] gives the same as a flow, [changes] the state of a camera. All functions may be called from any thread, but
 * [acquireFrame] and [seek] only one at a time.
 */
class Source internal constructor(context: Long, uri: String, config: Config) : AutoCloseable {
    internal val stateChanges = Changes { state, _, reason -> Change(State.entries.first { it.code == state }, reason) }
    internal val handle =
        handleThatKeeps(stateChanges, Native::maq_source_destroy) { id ->
            val native = config.native()
            native.state_callback = Addresses.ofSourceCallback()
            native.state_user_data = id
            Native.maq_source_create(context, textOf(uri), native)
        }

    /**
     * How it is opened.
     *
     * @property framePoolSize frames that the app may hold at once, 1 to 64.
     * @property queueLength for cameras: frames that wait for the app, 1 to 64; a new one replaces the oldest.
     * @property stallMs for cameras: after this time without a frame the camera counts as stalled, 50 to 60000 ms.
     * @property reconnectMs for cameras: how long to wait for one that was lost, 1 to 86400000 ms; -1: not at all.
     * @property isRealTime true: clips, recordings and stubs play in real time like a camera, unless the URI has
     *   `live=0`; false: frames come as fast as they are acquired, unless it has `live=1`.
     * @property isLoop true: a source that plays in real time starts again at its end, unless the URI has `loop=0`.
     * @property maxSidePx larger pictures are scaled down to this longer side; 0: they are not scaled.
     */
    data class Config(
        val framePoolSize: Int = 4,
        val queueLength: Int = 1,
        val stallMs: Int = 2000,
        val reconnectMs: Int = 30_000,
        val isRealTime: Boolean = false,
        val isLoop: Boolean = false,
        val maxSidePx: Int = 0,
    ) {
        internal fun native() =
            maq_source_config().also {
                it.frame_pool_size = framePoolSize
                it.queue_length = queueLength
                it.stall_ms = stallMs
                it.reconnect_ms = reconnectMs
                it.real_time = isRealTime.toInt()
                it.loop = isLoop.toInt()
                it.max_side_px = maxSidePx
            }
    }

    /**
     * Size, rate and number of the frames of a source.
     *
     * @property fps frames a second; 0 for a single image.
     * @property frameCount number of frames of the whole source; -1 if unknown or endless.
     * @property isLive true for a camera: frames that are not acquired in time are lost.
     * @property clock of the timestamps of its frames.
     * @property droppedFrames lost so far, by the camera or because they were not acquired in time.
     */
    data class Info(
        val widthPx: Int,
        val heightPx: Int,
        val fps: Double,
        val frameCount: Long,
        val isLive: Boolean,
        val clock: Clock,
        val framePoolSize: Int,
        val droppedFrames: Long,
    )

    /** Events of a camera. */
    enum class State(internal val code: Int) {
        STARTED(MAQ_SOURCE_STARTED),

        /** No frame for [Config.stallMs]; the camera may recover by itself. */
        STALLED(MAQ_SOURCE_STALLED),

        /** Unplugged or broken. */
        LOST(MAQ_SOURCE_LOST),

        /** The source tries to open it again, for [Config.reconnectMs]. */
        RECONNECTING(MAQ_SOURCE_RECONNECTING),

        /** Frames come again. */
        RECONNECTED(MAQ_SOURCE_RECONNECTED),
    }

    /** A change of state; [reason] is a sentence. */
    data class Change(val state: State, val reason: String)

    /** A setting of a camera. A device has some of them. */
    enum class Control(internal val code: Int) {
        /** 1: the device sets exposure and, on most devices, gain; 0: manual. */
        AUTO_EXPOSURE(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE),

        /** Microseconds. */
        EXPOSURE(MAQ_SOURCE_CONTROL_EXPOSURE),

        /** In units of the device. */
        GAIN(MAQ_SOURCE_CONTROL_GAIN),

        /** 1 or 0. */
        AUTO_FOCUS(MAQ_SOURCE_CONTROL_AUTO_FOCUS),

        /** In units of the device. */
        FOCUS(MAQ_SOURCE_CONTROL_FOCUS),

        /** 1 or 0. */
        AUTO_WHITE_BALANCE(MAQ_SOURCE_CONTROL_AUTO_WHITE_BALANCE),

        /** Kelvin. */
        WHITE_BALANCE(MAQ_SOURCE_CONTROL_WHITE_BALANCE),

        /** In units of the device. */
        BRIGHTNESS(MAQ_SOURCE_CONTROL_BRIGHTNESS),
    }

    /** The range of a control, in its unit; values are rounded to the nearest step. [value] is the one set now. */
    data class ControlInfo(
        val min: Double,
        val max: Double,
        val step: Double,
        val defaultValue: Double,
        val value: Double,
    )

    /**
     * A kind of source of this build.
     *
     * @property name the beginning of its URIs, "image".
     * @property example a URI, "image:photo.jpg".
     * @property summary what it delivers and its options, in a line.
     * @property isCamera true: always live.
     */
    data class Scheme(val name: String, val example: String, val summary: String, val isCamera: Boolean)

    /** As it is now. */
    val info: Info
        get() {
            val i = handle.read(maq_source_info(), Native::maq_source_get_info)
            return Info(
                i.width_px, i.height_px, i.fps, i.frame_count, i.is_live != 0, Clock.of(i.clock), i.frame_pool_size,
                i.dropped_frame_count,
            )
        }

    /** How the camera maps directions to pixels; null if that is unknown. */
    val intrinsics: Intrinsics?
        get() =
            orNull(Status.UNSUPPORTED) {
                Intrinsics.of(handle.read(maq_intrinsics(), Native::maq_source_get_intrinsics))
            }

    /**
     * Waits for the next frame; of a camera, for the oldest that waits. Files and stubs deliver at once, however short
     * the timeout, and block while they decode: not on the main thread. Close the frame soon: a camera has few.
     *
     * @param timeoutMs milliseconds; negative: without limit.
     * @return null after the last frame, and after [stop] or [close], which end a call that waits.
     * @throws MaquetteException with [Status.TIMEOUT]; [Status.DEVICE_LOST]; [Status.POOL_EMPTY] while
     *   [Config.framePoolSize] frames are open; [Status.UNREADABLE] for a damaged file; [Status.INVALID_ARGUMENT] while
     *   another thread acquires a frame.
     */
    fun acquireFrame(timeoutMs: Long = WAIT_FOREVER): Frame? =
        orNull(Status.END_OF_STREAM, Status.CANCELLED) {
            Frame(handle.use { Native.maq_source_acquire_frame(it, nanoseconds(timeoutMs)) })
        }

    /** Stops the source for good. Frames that are open stay valid. Does not block. */
    fun stop() = handle.use(Native::maq_source_stop)

    /**
     * The next frame will be the first at this time after the source's first frame, or later.
     *
     * @throws MaquetteException with [Status.UNSUPPORTED] for sources other than clips, recordings and stubs, and with
     *   [Status.INVALID_ARGUMENT] for a negative time.
     */
    fun seek(timeNs: Long) = handle.use { Native.maq_source_seek(it, timeNs) }

    /**
     * A control of the camera; null if the device does not have it. Blocks while the device answers.
     *
     * @throws MaquetteException with [Status.BUSY] (not now) and [Status.DEVICE_LOST].
     */
    fun control(control: Control): ControlInfo? =
        orNull(Status.UNSUPPORTED) {
            val c = maq_source_control_info()
            handle.use { Native.maq_source_get_control(it, control.code, c) }
            ControlInfo(c.min, c.max, c.step, c.default_value, c.value)
        }

    /**
     * Sets a control. A manual exposure, gain, focus or white balance switches off its automatic mode. Blocks while the
     * device answers.
     *
     * @throws MaquetteException with [Status.UNSUPPORTED] if the device does not have it, [Status.INVALID_ARGUMENT] out
     *   of its range, [Status.BUSY] (not now) and [Status.DEVICE_LOST].
     */
    fun setControl(control: Control, value: Double) =
        handle.use { Native.maq_source_set_control(it, control.code, value) }

    /** Stops the source and frees it. Blocks for at most 50 ms. Frames that are open stay valid. */
    override fun close() {
        handle.closeAfter(Native::maq_source_stop)
        stateChanges.end()
    }

    companion object {
        /** The kinds of sources of this build. */
        val schemes: List<Scheme>
            get() =
                List(Native.maq_source_get_scheme_count()) { index ->
                    val s = maq_source_scheme().also { Native.maq_source_get_scheme(index, it) }
                    Scheme(s.name.text(), s.example.text(), s.summary.text(), s.is_camera != 0)
                }
    }
}

/**
 * A camera that is connected. Listed by [Maquette.cameras].
 *
 * @property uri for [Maquette.source].
 * @property name the device's own; "" when it cannot be opened.
 * @property bus where it is plugged in.
 * @property status [Status.OK], or why it cannot be opened now.
 * @property problem the status in a sentence, and what to do.
 */
data class Camera(
    val uri: String,
    val name: String,
    val bus: String,
    val status: Status,
    val problem: String,
    val modes: List<Mode>,
) {
    /**
     * A format, size and rate that it offers.
     *
     * @property format four letters, as the device calls it: "YUYV", "MJPG".
     * @property isUsable whether this build supports the format.
     * @property fps the highest rate, frames a second; 0 if unknown.
     */
    data class Mode(
        val format: String,
        val isUsable: Boolean,
        val widthPx: Int,
        val heightPx: Int,
        val fps: Double,
    )

    internal companion object {
        fun all(context: Long): List<Camera> {
            val list = Native.maq_camera_list_create(context)
            try {
                return List(Native.maq_camera_list_get_count(list)) { index -> cameraAt(list, index) }
            } finally {
                Native.maq_camera_list_destroy(list)
            }
        }

        private fun cameraAt(list: Long, index: Int): Camera {
            val c = maq_camera_info().also { Native.maq_camera_list_get_camera(list, index, it) }
            val modes =
                List(c.mode_count) { mode ->
                    val m = maq_camera_mode().also { Native.maq_camera_list_get_mode(list, index, mode, it) }
                    Mode(m.format, m.is_usable != 0, m.width_px, m.height_px, m.fps)
                }
            return Camera(c.uri.text(), c.name.text(), c.bus.text(), Status.of(c.status), c.problem.text(), modes)
        }
    }
}
