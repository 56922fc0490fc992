package dev.maquette

import android.Manifest.permission.CAMERA
import android.app.Activity
import android.content.pm.PackageManager.PERMISSION_GRANTED
import android.graphics.Canvas
import android.os.Bundle
import android.widget.ImageView
import kotlin.concurrent.thread

/** The activity of docs/android.md, as it stands there; [LiveOverlayTest] runs it. */
open class LiveOverlay : Activity() {
    open val camera get() = "android:back?display=${windowManager.defaultDisplay.rotation * 90}"
    open val networks get() = ModelBundle.ofAssets(assets, "densepose-b-int8")
    private val maquette = Maquette()
    private var pipeline: Pipeline? = null

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        requestPermissions(arrayOf(CAMERA), 1)
    }

    override fun onResume() {
        super.onResume()
        if (checkSelfPermission(CAMERA) != PERMISSION_GRANTED) return
        val view = ImageView(this).also(::setContentView)
        val running = maquette.pipeline(networks).also { it.setSource(camera) }
        thread {
            generateSequence { running.acquireResult() }.forEach { result ->
                val picture = result.use { it.frame.toBitmap().also { on -> draw(it.densePose, on) } }
                view.post { view.setImageBitmap(picture) }
            }
            running.close()
        }
        pipeline = running
    }

    override fun onPause() {
        pipeline?.stop() // the thread ends
        super.onPause()
    }

    private fun draw(people: DensePoseResult, on: android.graphics.Bitmap) =
        Canvas(on).drawBitmap(people.overlay(), 0f, 0f, null)
}
