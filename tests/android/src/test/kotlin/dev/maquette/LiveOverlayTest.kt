package dev.maquette

import android.Manifest.permission.CAMERA
import android.graphics.drawable.BitmapDrawable
import android.os.Looper
import android.view.ViewGroup
import android.widget.ImageView
import java.io.File
import org.junit.Assert.assertEquals
import org.junit.Assert.assertNull
import org.junit.Assert.assertTrue
import org.junit.Test
import org.robolectric.Robolectric
import org.robolectric.RuntimeEnvironment
import org.robolectric.Shadows.shadowOf

/** The activity with rendered people in the place of the camera, and the networks from a folder. */
class OverlayOfStub : LiveOverlay() {
    override val camera get() = "stub:people?size=320x240&live=1"
    override val networks get() = ModelBundle.ofFolder(TestFiles.bundle.path)
}

class LiveOverlayTest : AndroidTest() {
    private val application = RuntimeEnvironment.getApplication()

    private fun pictureOf(activity: LiveOverlay): BitmapDrawable? {
        shadowOf(Looper.getMainLooper()).idle()
        val content = activity.findViewById<ViewGroup>(android.R.id.content)
        return (content.getChildAt(0) as ImageView?)?.drawable as BitmapDrawable?
    }

    @Test
    fun theActivityOfTheDocumentationShowsPeopleUntilItPauses() {
        shadowOf(application).grantPermissions(CAMERA)
        val controller = Robolectric.buildActivity(OverlayOfStub::class.java).setup()
        var picture: BitmapDrawable? = null
        within(30_000) {
            while (picture == null) {
                picture = pictureOf(controller.get())
                Thread.sleep(10)
            }
        }
        assertEquals(320, picture!!.bitmap.width)
        val pixels = IntArray(320 * 240).also { picture!!.bitmap.getPixels(it, 0, 320, 0, 0, 320, 240) }
        assertTrue("the frame is drawn", pixels.toSet().size > 1000)
        controller.pause()
        Thread.sleep(500)
        val last = pictureOf(controller.get())
        Thread.sleep(300)
        assertEquals("no pictures after the pause", last, pictureOf(controller.get()))
        controller.resume().pause().destroy()
    }

    @Test
    fun withoutThePermissionNothingRuns() {
        shadowOf(application).denyPermissions(CAMERA)
        val controller = Robolectric.buildActivity(OverlayOfStub::class.java).setup()
        assertNull(pictureOf(controller.get()))
        controller.pause().destroy()
    }

    @Test
    fun itIsWhatTheDocumentationShows() {
        val root = File(System.getProperty("maquette.root")!!)
        val source = File(root, "tests/android/src/test/kotlin/dev/maquette/LiveOverlay.kt").readText()
        val body = source.substringAfter("open class LiveOverlay").trimEnd()
        val shown = File(root, "docs/android.md").readText()
        val lines = "open class LiveOverlay$body".lines().joinToString("\n") { if (it.isEmpty()) it else "    $it" }
        assertTrue("docs/android.md shows another activity", shown.contains(lines))
    }
}
