package dev.maquette

import android.content.Context
import android.os.Handler
import android.os.Looper
import android.os.Trace
import android.util.AttributeSet
import android.util.Log
import android.view.SurfaceHolder
import android.view.SurfaceView
import dev.maquette.jni.Android
import java.util.concurrent.CountDownLatch
import kotlin.concurrent.thread

/**
 * Shows what a pipeline sees: each frame, and over it the people, every pixel in the colour of its body part. Native code
 * draws straight into the surface's memory, on a thread of the view's; the display's hardware scales.
 *
 * ```
 * view.show(maquette.pipeline(networks), "android:back")  // the app has the permission CAMERA
 * view.stop()                                             // in onPause: the camera is free for other apps
 * ```
 *
 * Functions and properties are for the main thread.
 */
class LiveView @JvmOverloads constructor(
    context: Context,
    attributes: AttributeSet? = null,
) : SurfaceView(context, attributes), SurfaceHolder.Callback {
    /** Where the picture has other sides than the view. */
    enum class Scaling {
        /** All of it, between black bars. */
        FIT,

        /** Its middle, which fills the view. */
        FILL,
    }

    @Volatile var scaling = Scaling.FIT

    /** Left and right change sides, as in a mirror: what people expect of a camera in the front. */
    @Volatile var isMirrored = false

    /** Opacity of the people's colours, 0 (the frame alone) to 255 (they cover it). */
    @Volatile var opacity = 180
        set(value) {
            require(value in 0..255) { "The opacity is $value; it must be 0 to 255." }
            field = value
        }

    private val preview = Handle(this, Android.createPreview(), Android::destroyPreview)
    private var showing: Showing? = null

    /** View.post would wait until the view has a window. */
    private val main = Handler(Looper.getMainLooper())

    init {
        holder.addCallback(this)
    }

    /**
     * Opens a source in [pipeline] and shows its results until [stop], another [show], or the view leaves its window. The
     * view closes the pipeline then, on a thread of its own; ask it for states and statistics until then.
     *
     * @param pipeline its [Pipeline.Config.resultPoolSize] must be 2 or more: the view keeps what it shows.
     * @param uri as of [Pipeline.setSource].
     * @param onResult gets each result once it is drawn, on the view's thread; the view closes it afterwards.
     * @param onProblem is told, on the main thread, why there are no results any longer; without it the log is.
     */
    fun show(
        pipeline: Pipeline,
        uri: String,
        onProblem: (MaquetteException) -> Unit = { Log.e(TAG, it.message, it) },
        onResult: (PipelineResult) -> Unit = {},
    ) {
        stop()
        pipeline.setSource(uri)
        showing = Showing(pipeline, onProblem, onResult)
    }

    /** Ends what [show] began; the last picture stays while the surface does. Nothing happens when nothing is shown. */
    fun stop() {
        showing?.end()
        showing = null
    }

    override fun onDetachedFromWindow() {
        stop()
        super.onDetachedFromWindow()
    }

    override fun surfaceCreated(holder: SurfaceHolder) = Unit // surfaceChanged follows

    override fun surfaceChanged(holder: SurfaceHolder, format: Int, width: Int, height: Int) {
        preview.use { Android.setSurface(it, holder.surface, width, height) }
        showing?.draw()
    }

    override fun surfaceDestroyed(holder: SurfaceHolder) = preview.use { Android.setSurface(it, null, 0, 0) }

    /** A pipeline that is shown, and its thread. */
    private inner class Showing(
        private val pipeline: Pipeline,
        private val onProblem: (MaquetteException) -> Unit,
        private val onResult: (PipelineResult) -> Unit,
    ) {
        private val end = CountDownLatch(1)

        /** On the surface, or to be drawn when there is one; of this object's lock, as drawing is. */
        private var latest: PipelineResult? = null

        init {
            thread(name = "maquette-view") { run() }
        }

        fun end() {
            try {
                pipeline.stop()
            } catch (_: IllegalStateException) {
                // The app closed it.
            }
            end.countDown()
        }

        @Synchronized
        fun draw() {
            val result = latest ?: return
            if (end.count == 0L) return // another is shown
            Trace.beginSection("maquette draw")
            try {
                preview.use { preview ->
                    result.frame.handle.use { frame ->
                        result.densePose.handle.use {
                            Android.drawOnSurface(preview, frame, it, scaling == Scaling.FILL, opacity, isMirrored)
                        }
                    }
                }
            } finally {
                Trace.endSection()
            }
        }

        private fun run() {
            try {
                generateSequence { pipeline.acquireResult() }.forEach { result ->
                    replace(result)
                    draw()
                    onResult(result)
                }
            } catch (error: MaquetteException) {
                main.post { onProblem(error) }
            } catch (error: IllegalStateException) {
                if (end.count != 0L) Log.w(TAG, "A view's pipeline was closed by others.", error)
            }
            end.await() // the surface may change, and want the last picture again
            replace(null)
            pipeline.close()
        }

        @Synchronized
        private fun replace(next: PipelineResult?) {
            latest?.close()
            latest = next
        }
    }

    private companion object {
        const val TAG = "maquette"
    }
}
