package dev.maquette.sample

import android.Manifest.permission.CAMERA
import android.content.pm.PackageManager.PERMISSION_GRANTED
import android.graphics.Bitmap
import android.graphics.Canvas
import android.os.Bundle
import dev.maquette.Pipeline
import dev.maquette.PipelineResult
import kotlin.concurrent.thread

/** The camera's people, each pixel in the colour of its body part. */
open class LiveActivity : Screen() {
    private var facing = "back"
    private var pipeline: Pipeline? = null

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        facing = state?.getString("facing") ?: facing
        button("Other camera") {
            facing = if (facing == "back") "front" else "back"
            startCamera()
        }
        if (!mayUseCamera()) requestPermissions(arrayOf(CAMERA), 1)
    }

    override fun onSaveInstanceState(state: Bundle) {
        super.onSaveInstanceState(state)
        state.putString("facing", facing)
    }

    override fun onResume() {
        super.onResume()
        if (mayUseCamera()) start() else say("Allow the camera in the settings of this app to see its people.")
    }

    override fun onPause() {
        pipeline?.stop()
        pipeline = null
        super.onPause()
    }

    /** The source's URI. Pictures are upright on a display that is rotated by [displayDegrees]. */
    protected open fun camera(
        facing: String,
        displayDegrees: Int,
    ) = "android:$facing?display=$displayDegrees"

    private fun mayUseCamera() = checkSelfPermission(CAMERA) == PERMISSION_GRANTED

    private fun start() {
        val running = maquette.pipeline(networks("densepose-b-int8"), Pipeline.Config(frameBudgetMs = FRAME_MS))
        pipeline = running
        startCamera()
        // Ends when the pipeline is stopped.
        thread {
            val problem = runCatching { generateSequence { running.acquireResult() }.forEach(::showResult) }
            runOnUiThread { problem.exceptionOrNull()?.let { say(it.message ?: it.toString()) } }
            running.close()
        }
    }

    private fun startCamera() {
        picture.scaleX = if (facing == "front") -1f else 1f // as in a mirror
        pipeline?.setSource(camera(facing, windowManager.defaultDisplay.rotation * 90))
    }

    private fun showResult(result: PipelineResult) {
        val people = people(result.densePose.people.size)
        val bitmap = result.use { it.frame.toBitmap().also { frame -> drawParts(it, frame) } }
        val stats = pipeline?.stats ?: return
        runOnUiThread {
            show(bitmap, "The camera's picture, $people painted by body part")
            say("%s, %.0f pictures a second".format(people, stats.resultsPerSecond))
        }
    }

    private fun drawParts(
        result: PipelineResult,
        frame: Bitmap,
    ) = Canvas(frame).drawBitmap(result.densePose.overlay(), 0f, 0f, null)

    private companion object {
        /** Of a camera of 30 pictures a second: on a device that throttles the networks do less. */
        const val FRAME_MS = 33.0
    }
}
