package dev.maquette.sample

import android.content.Intent
import android.os.Bundle
import dev.maquette.Maquette

/** The list of screens. */
class MainActivity : Screen(columns = 1) {
    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        say("Maquette ${Maquette.version}. Everything is computed on this device; nothing is sent anywhere.")
        removePicture()
        open("Live: people of the camera", LiveActivity::class.java)
        open("Photo: people of a picture", PhotoActivity::class.java)
        open("Head: a person's head in 3D", HeadActivity::class.java)
        // By its name: it is in builds with ARCore alone.
        val capture = Intent().setClassName(this, "dev.maquette.sample.ArCaptureActivity")
        if (packageManager.resolveActivity(capture, 0) != null) {
            button("Capture: a place to look around in") { startActivity(capture) }
        }
        open("Scene: look around in a place", SceneActivity::class.java)
        open("Benchmark: how fast this device is", BenchmarkActivity::class.java)
    }

    private fun open(text: String, screen: Class<out Screen>) {
        button(text) { startActivity(Intent(this, screen)) }
    }
}
