package dev.maquette

import android.Manifest.permission.CAMERA
import android.app.Activity
import android.view.ViewGroup
import dev.maquette.examples.LiveOverlay
import java.io.File
import org.junit.Assert.assertEquals
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

    private fun viewOf(activity: Activity) =
        activity.findViewById<ViewGroup>(android.R.id.content).getChildAt(0) as LiveView

    @Test
    fun theActivityOfTheDocumentationShowsPeopleUntilItPauses() {
        shadowOf(application).grantPermissions(CAMERA)
        val controller = Robolectric.buildActivity(OverlayOfStub::class.java).setup()
        val screen = FakeSurface(viewOf(controller.get()))
        screen.appear(640, 960)
        val picture = screen.picture { it.posts >= 3 }
        assertEquals("all of the frame, between bars", 320 to 480, picture.widthPx to picture.heightPx)
        assertEquals(0, picture.colour(160, 10))
        assertTrue("the frame is drawn", picture.colours > 1000)
        val threads = threadsOfView()
        assertEquals(1, threads.size)
        controller.pause()
        threads.forEach { it.join(30_000) } // the pipeline is closed
        assertEquals(0, threadsOfView().size)
        controller.resume()
        val before = screen.picture().posts
        screen.picture { it.posts > before }
        controller.pause()
        screen.vanish()
        controller.stop().destroy()
        assertEquals("", FakeAndroid.misuse())
    }

    @Test
    fun withoutThePermissionNothingRuns() {
        shadowOf(application).denyPermissions(CAMERA)
        val controller = Robolectric.buildActivity(OverlayOfStub::class.java).setup()
        assertEquals(0, threadsOfView().size)
        controller.pause().destroy()
    }

    @Test
    fun itIsWhatTheDocumentationShowsInTwentyLines() {
        val root = File(System.getProperty("maquette.root")!!)
        val source = File(root, "examples/kotlin/LiveOverlay.kt").readText()
        val body = "open class LiveOverlay" + source.substringAfter("open class LiveOverlay").trimEnd()
        assertTrue("${body.lines().size} lines", body.lines().size <= 20)
        val lines = body.lines().joinToString("\n") { if (it.isEmpty()) it else "    $it" }
        val shown = File(root, "docs/guide/android.md").readText()
        assertTrue("docs/guide/android.md shows another activity", shown.contains(lines))
    }
}
