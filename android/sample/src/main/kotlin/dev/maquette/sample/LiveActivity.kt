package dev.maquette.sample

import android.Manifest.permission.CAMERA
import android.content.pm.PackageManager.PERMISSION_GRANTED
import android.os.Bundle
import dev.maquette.Pipeline
import dev.maquette.PipelineResult
import kotlin.concurrent.thread

/** The camera's people, painted by body part or dressed. */
open class LiveActivity : PeopleScreen() {
    private var facing = "back"
    private var pipeline: Pipeline? = null

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        facing = state?.getString("facing") ?: facing
        button("Other camera") {
            facing = if (facing == "back") "front" else "back"
            startCamera()
        }
        addModeButtons()
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
    protected open fun camera(facing: String, displayDegrees: Int) = "android:$facing?display=$displayDegrees"

    private fun mayUseCamera() = checkSelfPermission(CAMERA) == PERMISSION_GRANTED

    private fun start() {
        val running = maquette.pipeline(networks("densepose-b-int8"), Pipeline.Config(frameBudgetMs = FRAME_MS))
        pipeline = running
        startCamera()
        // Ends when the pipeline is stopped.
        thread {
            val problem =
                runCatching { generateSequence { running.acquireResult() }.forEach { showResult(running, it) } }
            runOnUiThread { problem.exceptionOrNull()?.let { say(it.message ?: it.toString()) } }
            running.close()
        }
    }

    private fun startCamera() {
        picture.scaleX = if (facing == "front") -1f else 1f // as in a mirror
        pipeline?.setSource(camera(facing, windowManager.defaultDisplay.rotation * 90))
    }

    private fun showResult(running: Pipeline, result: PipelineResult) = result.use {
        val people = people(it.densePose.people.size)
        val bitmap = it.frame.toBitmap()
        val how = paint(bitmap, it.densePose, running::surface)
        val perSecond = running.stats.resultsPerSecond
        runOnUiThread {
            show(bitmap, "The camera's picture, $people $how")
            say("%s, %.0f pictures a second".format(people, perSecond))
        }
    }

    private companion object {
        /** Time between two frames of a camera of 30 a second. On a device that throttles, the networks do less. */
        const val FRAME_MS = 33.0
    }
}
