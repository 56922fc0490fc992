package dev.maquette.sample

import android.Manifest.permission.CAMERA
import android.content.Intent
import android.content.pm.PackageManager.PERMISSION_GRANTED
import android.graphics.Bitmap
import android.graphics.Matrix
import android.net.Uri
import android.os.Bundle
import android.widget.Button
import android.widget.Toast
import java.io.File
import kotlin.concurrent.thread

/** Makes a scene of a place: walk around, then build it. What knows where the camera is comes from a subclass. */
abstract class CaptureActivity : Screen() {
    private val capture = PlaceCapture()
    private lateinit var buildButton: Button

    /** The thread that asks the camera runs while it is this one's. */
    @Volatile
    private var running: Thread? = null

    @Volatile
    private var isBuilding = false

    /** Called on the thread that will use the camera. Throws, with a sentence, where there is none. */
    protected abstract fun openCamera(): PosedCamera

    /** A text that the user must read before the capture; may be empty. */
    protected open val notice: String get() = ""

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        say("Walk slowly around the place. Photos and what is built of them stay on this device. $notice".trim())
        buildButton = button("Build the scene") { build() }
        buildButton.isEnabled = false
        if (!mayUseCamera()) requestPermissions(arrayOf(CAMERA), 1)
    }

    override fun onResume() {
        super.onResume()
        if (isReady()) startCamera()
    }

    /** Whether the camera can be opened; if not, it has said why. */
    protected open fun isReady(): Boolean {
        if (!mayUseCamera()) say("Allow the camera in the settings of this app to capture a place.")
        return mayUseCamera()
    }

    override fun onPause() {
        stopCamera()
        super.onPause()
    }

    override fun close() {
        synchronized(capture) { capture.close() }
        super.close()
    }

    /** Long side of the images that the scene is built from. */
    protected open val longSidePx get() = 640

    private fun mayUseCamera() = checkSelfPermission(CAMERA) == PERMISSION_GRANTED

    private fun startCamera() {
        if (isBuilding) return
        val started = thread(start = false) { follow() }
        running = started // before it looks
        started.start()
    }

    private fun stopCamera() {
        val stopped = running ?: return
        running = null
        stopped.join()
    }

    private fun follow() {
        val result = runCatching {
            openCamera().use { camera ->
                while (running === Thread.currentThread()) {
                    val image = camera.next()
                    if (image != null) take(image) else camera.problem?.let { runOnUiThread { say(it) } }
                }
            }
        }
        result.onFailure { runOnUiThread { say(it.message ?: it.toString()) } }
    }

    private fun take(image: TrackedImage) {
        val turn = Matrix().apply { postRotate(image.degreesToUpright.toFloat()) }
        val bitmap = image.frame.toBitmap()
        val upright = Bitmap.createBitmap(bitmap, 0, 0, bitmap.width, bitmap.height, turn, true)
        val (verdict, photos, points) =
            synchronized(capture) { Triple(capture.offer(image), capture.photoCount, capture.pointCount) }
        val advice =
            when (verdict) {
                PlaceCapture.Verdict.KEPT -> "Go on."
                PlaceCapture.Verdict.NOT_NEW -> "Move on to see it from elsewhere."
                PlaceCapture.Verdict.BLURRED -> "Move more slowly."
                PlaceCapture.Verdict.FULL -> "That is enough: build the scene."
            }
        runOnUiThread {
            show(upright, "The camera's picture of the place")
            say("$photos photos, $points points. $advice")
            buildButton.isEnabled = photos >= PlaceCapture.MIN_PHOTOS && !isBuilding
        }
    }

    private fun build() {
        isBuilding = true
        buildButton.isEnabled = false
        stopCamera()
        val file = File(filesDir, "place.maqs")
        val tell = { done: Double, stage: String ->
            runOnUiThread { say("Building: %.0f %%. %s".format(100 * done, stage)) }
            !isDestroyed
        }
        val work = {
            synchronized(capture) { capture.build(maquette, networks("scenes-int8"), longSidePx, tell) }
                .use { it.save(file.path) }
        }
        inBackground({ runCatching(work) }) { result ->
            isBuilding = false
            buildButton.isEnabled = true
            result
                .onSuccess {
                    say("Built. Go back to look at it again: \"Scene\".")
                    startActivity(Intent(this, SceneActivity::class.java).setData(Uri.fromFile(file)))
                }.onFailure {
                    // The sentence is soon about the next picture.
                    Toast.makeText(this, it.message, Toast.LENGTH_LONG).show()
                    if (isResumed && isReady()) startCamera()
                }
        }
    }
}
