package dev.maquette.examples

import android.Manifest.permission.CAMERA
import android.app.Activity
import android.content.pm.PackageManager.PERMISSION_GRANTED
import android.os.Bundle
import dev.maquette.LiveView
import dev.maquette.Maquette
import dev.maquette.ModelBundle

/** The activity of docs/guide/android.md, as it stands there; LiveOverlayTest runs it. */
open class LiveOverlay : Activity() {
    open val camera get() = "android:back?display=${windowManager.defaultDisplay.rotation * 90}"
    open val networks get() = ModelBundle.ofAssets(assets, "densepose-b-int8")
    private val view by lazy { LiveView(this).also(::setContentView) }

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        requestPermissions(arrayOf(CAMERA), 1)
    }

    override fun onResume() {
        super.onResume()
        if (checkSelfPermission(CAMERA) == PERMISSION_GRANTED) view.show(Maquette().pipeline(networks), camera)
    }

    override fun onPause() {
        view.stop()
        super.onPause()
    }
}
