package dev.maquette

import android.os.Looper
import java.util.concurrent.ConcurrentLinkedQueue
import org.junit.After
import org.junit.Assert.assertEquals
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test
import org.robolectric.RuntimeEnvironment
import org.robolectric.Shadows.shadowOf

class LiveViewTest : AndroidTest() {
    private val maquette = Maquette()
    private val view = LiveView(RuntimeEnvironment.getApplication())
    private val screen = FakeSurface(view)

    private fun pipeline() = maquette.pipeline(ModelBundle.ofFolder(TestFiles.bundle.path))

    private fun photo() = "image:${TestFiles.photo.path}"

    @After
    fun nothingIsLeft() {
        view.stop()
        threadsOfView().forEach { it.join(30_000) }
        assertEquals(0, threadsOfView().size)
        screen.vanish()
        assertEquals("", FakeAndroid.misuse())
    }

    @Test
    fun aPictureIsDrawnAgainWhenTheSurfaceComesOrChanges() {
        val results = ConcurrentLinkedQueue<List<Person>>()
        view.show(pipeline(), photo(), onResult = { results.add(it.densePose.people) })
        until("results come before there is a surface") { results.isNotEmpty() }
        screen.appear(1000, 1000)
        val square = screen.picture()
        assertEquals(square.widthPx, square.heightPx)
        screen.resize(2000, 1000)
        val wide = screen.picture { it.posts == 2 }
        assertEquals(2.0, wide.widthPx.toDouble() / wide.heightPx, 0.01)
        assertEquals(1, results.size)
        assertTrue("${results.peek()}", results.peek()!!.isNotEmpty())
    }

    @Test
    fun theStyleIsThatOfThePicture() {
        view.opacity = 0
        view.show(pipeline(), photo())
        maquette.source(photo()).use { source ->
            source.acquireFrame()!!.use { frame ->
                val bitmap = frame.toBitmap()
                val (width, height) = frame.widthPx to frame.heightPx
                screen.appear(width, height)
                val plain = screen.picture()
                assertEquals(width to height, plain.widthPx to plain.heightPx)
                val points = listOf(0 to 0, 17 to 5, width - 1 to height - 1, width / 2 to height / 2)
                for ((x, y) in points) assertEquals(bitmap.getPixel(x, y) and 0xFFFFFF, plain.colour(x, y))
                view.isMirrored = true
                screen.resize(width, height)
                val mirrored = screen.picture { it.posts == 2 }
                for ((x, y) in points) {
                    assertEquals(bitmap.getPixel(x, y) and 0xFFFFFF, mirrored.colour(width - 1 - x, y))
                }
                view.scaling = LiveView.Scaling.FILL
                screen.resize(height / 2, height)
                assertEquals(height / 2, screen.picture { it.posts == 3 }.widthPx)
            }
        }
        assertThrows(IllegalArgumentException::class.java) { view.opacity = 256 }
    }

    @Test
    fun whatFailsIsToldOnTheMainThreadAndLeavesTheViewUsable() {
        val problems = ConcurrentLinkedQueue<MaquetteException>()
        view.show(pipeline(), "image:/nowhere.jpg", onProblem = { problems.add(it) })
        until("the problem is told", meanwhile = { shadowOf(Looper.getMainLooper()).idle() }) { problems.isNotEmpty() }
        assertEquals(Status.NOT_FOUND, problems.peek()!!.status)
        screen.appear(320, 240)
        view.show(pipeline(), photo())
        screen.picture()
    }

    @Test
    fun shownStoppedAndResizedAtAnyTimeNothingHangs() {
        soon {
            repeat(12) { round ->
                view.show(pipeline(), "stub:people?size=160x120&live=1&seed=$round")
                if (round % 2 == 0) screen.appear(160 + round, 120)
                if (round % 3 == 0) screen.picture()
                screen.resize(120, 160 + round)
                if (round % 4 == 3) view.stop()
            }
        }
    }

    @Test
    fun aPipelineThatTheAppClosesEndsThePictures() {
        screen.appear(320, 240)
        val pipeline = pipeline()
        view.show(pipeline, "stub:people?size=160x120&live=1")
        screen.picture()
        pipeline.close()
        view.stop()
    }
}
