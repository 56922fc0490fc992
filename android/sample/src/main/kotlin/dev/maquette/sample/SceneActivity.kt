package dev.maquette.sample

import android.annotation.SuppressLint
import android.content.Intent
import android.net.Uri
import android.os.Bundle
import android.view.MotionEvent
import dev.maquette.Scene
import dev.maquette.SceneRenderer
import java.nio.ByteBuffer
import java.util.concurrent.atomic.AtomicBoolean

/** A scene file (.maqs, of `maquette scene build`) that the user picks, from wherever the finger drags the camera. */
open class SceneActivity : Screen() {
    private class View(val scene: Scene, val renderer: SceneRenderer, var orbit: Orbit)

    @Volatile
    private var view: View? = null
    private val isDrawing = AtomicBoolean()
    private var last = 0f to 0f

    @SuppressLint("ClickableViewAccessibility") // the buttons below do the same
    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        say("Choose a scene file (.maqs).")
        button("Choose a scene") {
            val pick = Intent(Intent.ACTION_OPEN_DOCUMENT).addCategory(Intent.CATEGORY_OPENABLE).setType("*/*")
            startActivityForResult(pick, 1)
        }
        button("To the left") { move { moved(across = -STEP) } }
        button("To the right") { move { moved(across = STEP) } }
        // A room is seen from within, a thing from outside.
        button("Nearer") { move { moved(nearer = NEARER) } }
        button("Farther") { move { moved(nearer = 1 / NEARER) } }
        picture.setOnTouchListener { _, event ->
            if (event.action == MotionEvent.ACTION_MOVE) {
                val (x, y) = last
                move { moved((x - event.x) * RADIANS_PER_PX, (event.y - y) * RADIANS_PER_PX) }
            }
            last = event.x to event.y
            true
        }
        intent.data?.let(::load) // a scene that was captured
    }

    @Deprecated("the platform's way without androidx")
    override fun onActivityResult(request: Int, result: Int, data: Intent?) {
        data?.data?.let(::load)
    }

    private fun load(file: Uri) {
        say("Opening …")
        inBackground({ open(read(file)) }) {
            say("Drag to look around.")
            draw()
        }
    }

    override fun close() {
        closeView()
        super.close()
    }

    protected open fun read(file: Uri): ByteArray = contentResolver.openInputStream(file)!!.use { it.readBytes() }

    private fun open(bytes: ByteArray) {
        closeView()
        val scene = maquette.openScene(ByteBuffer.allocateDirect(bytes.size).apply { put(bytes) })
        val info = scene.info
        view = View(scene, maquette.sceneRenderer(scene, networks("scenes-int8")), Orbit.around(info))
    }

    private fun closeView() {
        view?.renderer?.close()
        view?.scene?.close()
        view = null
    }

    private fun move(how: Orbit.() -> Orbit) {
        val shown = view ?: return
        shown.orbit = shown.orbit.how()
        draw()
    }

    /** Renders in the background; movements meanwhile are in the next picture. */
    private fun draw() {
        val drawn = view ?: return
        if (!isDrawing.compareAndSet(false, true)) return
        val orbit = drawn.orbit
        inBackground({
            try {
                drawn.renderer.run(orbit.camera(WIDTH_PX, HEIGHT_PX)).use { it.toBitmap() }
            } finally {
                isDrawing.set(false)
            }
        }) { bitmap ->
            show(bitmap, "The scene from a new viewpoint")
            if (view?.orbit != orbit) draw()
        }
    }

    private companion object {
        const val WIDTH_PX = 480
        const val HEIGHT_PX = 360
        const val STEP = 0.2
        const val NEARER = 0.7
        const val RADIANS_PER_PX = 0.005
    }
}
