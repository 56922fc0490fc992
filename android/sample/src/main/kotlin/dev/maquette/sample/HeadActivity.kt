package dev.maquette.sample

import android.annotation.SuppressLint
import android.content.Intent
import android.graphics.Bitmap
import android.net.Uri
import android.os.Bundle
import android.view.MotionEvent
import android.widget.Button
import dev.maquette.DensePoseResult
import dev.maquette.Head
import dev.maquette.HeadBox
import dev.maquette.HeadBuilder
import dev.maquette.HeadMesh
import dev.maquette.HeadRenderer
import java.io.File
import java.util.concurrent.atomic.AtomicBoolean

/** The head of a person in 3D, out of photos that the user picks; it forms while one watches, and turns with the finger. */
open class HeadActivity : PictureScreen() {
    /** Where the camera stands, radians: to the person's left, and above. */
    private data class Place(val yaw: Double = 0.0, val pitch: Double = 0.0)

    private class View(val mesh: HeadMesh, val renderer: HeadRenderer)

    // The worker alone uses these. The networks are loaded when there is a photo.
    private val densePose = lazy { maquette.densePose(networks("densepose-b-int8")) }
    private val builder = lazy {
        maquette.headBuilder(networks("heads-int8"), HeadBuilder.Config(texturePx = TEXTURE_PX))
    }
    private var view: View? = null

    private var place = Place()
    private var shading = HeadRenderer.Shading.COLOUR
    private lateinit var shadingButton: Button
    private val isDrawing = AtomicBoolean()
    private var last = 0f to 0f

    @SuppressLint("ClickableViewAccessibility") // the buttons below do the same
    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        say("Choose a photo of somebody who agrees to it. It stays on this device.")
        button("Choose a photo") { pickImage(FIRST) }
        button("Add a photo") { pickImage(ANOTHER) }
        button("To the left") { turn(-STEP) }
        button("To the right") { turn(STEP) }
        shadingButton = button(SHAPE) { changeShading() }
        button("Save as GLB") { askForFile() }
        picture.setOnTouchListener { _, event ->
            val (x, y) = last
            if (event.action == MotionEvent.ACTION_MOVE) {
                turn((x - event.x) * RADIANS_PER_PX, (event.y - y) * RADIANS_PER_PX)
            }
            last = event.x to event.y
            true
        }
    }

    override fun onPicked(request: Int, image: Uri) {
        if (request == SAVE) return save(image)
        say("Looking for the head …")
        inBackground({ build(decode(image), isFirst = request == FIRST) }) { sentence ->
            say(sentence)
            draw()
        }
    }

    override fun close() {
        closeView()
        if (builder.isInitialized()) builder.value.close()
        if (densePose.isInitialized()) densePose.value.close()
        super.close()
    }

    /** On the worker; returns what is to be said. The head that is shown stays when it fails. */
    private fun build(photo: Bitmap, isFirst: Boolean): String {
        val builder = builder.value
        if (isFirst) builder.clear()
        maquette.frame(photo).use { frame ->
            val box = densePose.value.run(frame).use(::largestHead)
            builder.addPhoto(frame, box)
        }
        val head = builder.fit(SECONDS, preview = ::showPreview) { _, _ -> !isDestroyed } // false cancels
        val mesh = head.use { it.mesh() }
        closeView()
        view = View(mesh, maquette.headRenderer(mesh))
        val used = builder.stats.usedPhotos
        val from = if (used == 1) "1 photo" else "$used photos"
        val rejected = builder.stats.photos - used
        return "A head from $from" + if (rejected > 0) "; $rejected rejected, of a different person." else ". Drag to turn it."
    }

    private fun largestHead(people: DensePoseResult): HeadBox? =
        people.people.indices
            .mapNotNull(people::headBox)
            .maxByOrNull { (it.right - it.left) * (it.bottom - it.top) }

    /** The head as far as it is, with a coarse mesh: the fit waits. */
    private fun showPreview(head: Head) {
        val picture =
            head.use { it.mesh(HeadMesh.Config(cellM = PREVIEW_CELL_M)) }.use { mesh ->
                maquette.headRenderer(mesh)
                    .use { renderer -> renderer.run(renderer.camera(0.0, 0.0, SIDE_PX, SIDE_PX)).use { it.toBitmap() } }
            }
        runOnUiThread {
            if (isDestroyed) return@runOnUiThread
            show(picture, "The head, not finished yet")
            say("Fitting it to the photo …")
        }
    }

    private fun closeView() {
        view?.renderer?.close()
        view?.mesh?.close()
        view = null
    }

    private fun turn(yaw: Double, pitch: Double = 0.0) {
        place = Place(place.yaw + yaw, (place.pitch + pitch).coerceIn(-MAX_PITCH, MAX_PITCH))
        draw()
    }

    private fun changeShading() {
        val isColour = shading == HeadRenderer.Shading.COLOUR
        shading = if (isColour) HeadRenderer.Shading.SHAPE else HeadRenderer.Shading.COLOUR
        shadingButton.text = if (isColour) COLOURS else SHAPE
        draw()
    }

    /** Renders in the background; movements meanwhile are in the next picture. */
    private fun draw() {
        if (!isDrawing.compareAndSet(false, true)) return
        val drawn = place to shading
        inBackground({
            try {
                view?.renderer?.let { renderer ->
                    renderer.setShading(drawn.second)
                    val camera = renderer.camera(drawn.first.yaw, drawn.first.pitch, SIDE_PX, SIDE_PX)
                    renderer.run(camera).use { it.toBitmap() }
                }
            } finally {
                isDrawing.set(false)
            }
        }) { bitmap ->
            if (bitmap == null) return@inBackground // no head yet
            show(bitmap, "The head, turned by %.0f degrees".format(Math.toDegrees(drawn.first.yaw)))
            if (drawn != place to shading) draw()
        }
    }

    private fun askForFile() {
        val create = Intent(Intent.ACTION_CREATE_DOCUMENT).addCategory(Intent.CATEGORY_OPENABLE)
        startActivityForResult(create.setType("model/gltf-binary").putExtra(Intent.EXTRA_TITLE, "head.glb"), SAVE)
    }

    private fun save(to: Uri) =
        inBackground({
            val mesh = view?.mesh ?: error("There is no head yet: choose a photo.")
            val file = File.createTempFile("head", ".glb", cacheDir)
            try {
                mesh.save(file.path)
                write(to, file)
            } finally {
                file.delete()
            }
        }) { say("Saved. The file has the face's pixels: keep it as you would keep a photo.") }

    protected open fun write(to: Uri, file: File) {
        contentResolver.openOutputStream(to)!!.use { stream -> file.inputStream().use { it.copyTo(stream) } }
    }

    private companion object {
        const val FIRST = 1
        const val ANOTHER = 2
        const val SAVE = 3
        const val SHAPE = "Show the shape"
        const val COLOURS = "Show colours"
        const val SECONDS = 3.0
        const val TEXTURE_PX = 512
        const val PREVIEW_CELL_M = 0.004
        const val SIDE_PX = 480
        const val STEP = 0.3
        const val MAX_PITCH = 1.2
        const val RADIANS_PER_PX = 0.005
    }
}
