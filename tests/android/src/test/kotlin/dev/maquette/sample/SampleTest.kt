package dev.maquette.sample

import android.Manifest.permission.CAMERA
import android.app.Activity
import android.content.Intent
import android.graphics.Bitmap
import android.graphics.BitmapFactory
import android.graphics.drawable.BitmapDrawable
import android.net.Uri
import android.os.Looper
import android.view.View
import android.view.ViewGroup
import android.widget.Button
import android.widget.ImageView
import android.widget.TextView
import dev.maquette.AndroidTest
import dev.maquette.Maquette
import dev.maquette.ModelBundle
import dev.maquette.Scene
import dev.maquette.SceneBuildConfig
import dev.maquette.TestFiles
import java.io.File
import org.json.JSONObject
import org.junit.Assert.assertEquals
import org.junit.Assert.assertFalse
import org.junit.Assert.assertTrue
import org.junit.Test
import org.robolectric.Robolectric
import org.robolectric.RuntimeEnvironment
import org.robolectric.Shadows.shadowOf
import org.robolectric.android.controller.ActivityController

private fun fromFolder(name: String) = ModelBundle.ofFolder(TestFiles.bundle.resolveSibling(name).path)

private val outfit = TestFiles.bundle.resolve("../../../desktop_demo/assets/outfit.png")

private fun readBitmap(file: File): Bitmap = BitmapFactory.decodeFile(file.path).copy(Bitmap.Config.ARGB_8888, true)

class LiveOfStub : LiveActivity() {
    override fun networks(name: String) = fromFolder(name)

    override fun defaultOutfit() = readBitmap(outfit)

    override fun camera(
        facing: String,
        displayDegrees: Int,
    ) = "stub:people?size=160x120&count=${if (facing == "back") 1 else 2}&live=1"
}

class PhotoOfFile : PhotoActivity() {
    override fun networks(name: String) = fromFolder(name)

    override fun defaultOutfit() = readBitmap(outfit)

    override fun decode(image: Uri) = readBitmap(File(image.path!!))
}

class HeadOfFile : HeadActivity() {
    override fun networks(name: String) = fromFolder(name)

    override fun decode(image: Uri) = readBitmap(File(image.path!!))

    override fun write(to: Uri, file: File) {
        file.copyTo(File(to.path!!))
    }
}

class SceneOfFile : SceneActivity() {
    override fun networks(name: String) = fromFolder(name)

    override fun read(file: Uri): ByteArray = File(file.path!!).readBytes()
}

class CaptureOfRoom : CaptureActivity() {
    override fun networks(name: String) = fromFolder(name)

    override val longSidePx get() = 160

    override fun openCamera() = PosedRoom(maquette, everyPhoto = 5)
}

class CaptureWithoutCamera : CaptureActivity() {
    override val notice get() = "This device has a notice."

    override fun openCamera() = error("This device has no ARCore: open a scene file.")
}

class ShortBenchmark : BenchmarkActivity() {
    override fun networks(name: String) = fromFolder(name)

    override fun report(progress: (Double) -> Unit): JSONObject =
        Benchmark(maquette, networks("densepose-b-int8"))
            .run(listOf("stub:people?size=160x120", TestFiles.photo.path), runs = 12, progress = progress)
}

/** The screens of the sample app, with files and rendered people in the place of cameras and pickers. */
class SampleTest : AndroidTest() {
    /** All, from top to bottom. */
    private fun views(activity: Activity): List<View> {
        fun below(view: View): List<View> =
            listOf(view) + if (view is ViewGroup) List(view.childCount, view::getChildAt).flatMap(::below) else listOf()
        return below(activity.findViewById(android.R.id.content))
    }

    private fun sentence(activity: Activity) = views(activity).filterIsInstance<TextView>().first().text.toString()

    private fun picture(activity: Activity) = views(activity).filterIsInstance<ImageView>().single()

    private fun button(
        activity: Activity,
        text: String,
    ) = views(activity).filterIsInstance<Button>().single { it.text.startsWith(text) }

    private fun until(activity: Activity, what: String, condition: () -> Boolean) {
        try {
            until(what, meanwhile = { shadowOf(Looper.getMainLooper()).idle() }, condition)
        } catch (error: AssertionError) {
            throw AssertionError("${error.message}; it says: ${sentence(activity)}")
        }
    }

    private fun <T : Activity> screen(type: Class<T>, test: (T) -> Unit) {
        val controller: ActivityController<T> = Robolectric.buildActivity(type).setup()
        try {
            test(controller.get())
        } finally {
            controller.pause().stop().destroy()
        }
    }

    /** The answer of a picker. */
    private fun answer(activity: Activity, file: File) {
        val asked = shadowOf(activity).nextStartedActivityForResult
        val data = Intent().setData(Uri.fromFile(file))
        shadowOf(activity).receiveResult(asked.intent, Activity.RESULT_OK, data)
    }

    @Test
    fun theListOpensEachScreen() =
        screen(MainActivity::class.java) { main ->
            assertTrue(sentence(main).contains("nothing is sent anywhere"))
            val opened =
                views(main).filterIsInstance<Button>().map {
                    it.performClick()
                    shadowOf(main).nextStartedActivity.component!!.className.substringAfterLast('.')
                }
            assertEquals(listOf("LiveActivity", "PhotoActivity", "HeadActivity", "SceneActivity", "BenchmarkActivity"), opened)
        }

    @Test
    fun theCameraIsShownWithPeopleAndMirroredInFront() {
        shadowOf(RuntimeEnvironment.getApplication()).grantPermissions(CAMERA)
        screen(LiveOfStub::class.java) { live ->
            until(live, "people of the back camera") { picture(live).contentDescription?.contains("1 person") == true }
            assertEquals(1f, picture(live).scaleX)
            button(live, "Try on").performClick()
            until(live, "a dressed person") { picture(live).contentDescription.contains("1 person dressed") }
            button(live, "Body parts").performClick()
            until(live, "body parts") { picture(live).contentDescription.contains("1 person painted by body part") }
            button(live, "Other camera").performClick()
            until(live, "people of the front camera") { picture(live).contentDescription?.contains("2 people") == true }
            assertEquals(-1f, picture(live).scaleX)
            assertTrue(sentence(live), sentence(live).contains("pictures a second"))
        }
    }

    @Test
    fun withoutThePermissionTheScreenSaysWhatToDo() {
        shadowOf(RuntimeEnvironment.getApplication()).denyPermissions(CAMERA)
        screen(LiveOfStub::class.java) { assertTrue(sentence(it).startsWith("Allow the camera")) }
    }

    @Test
    fun aPhotoShowsItsPeople() =
        screen(PhotoOfFile::class.java) { photo ->
            button(photo, "Choose").performClick()
            answer(photo, TestFiles.photo)
            until(photo, "the people of the photo") { sentence(photo).contains(Regex("^[1-9] (person|people) in")) }
            val shown = (picture(photo).drawable as BitmapDrawable).bitmap
            val original = BitmapFactory.decodeFile(TestFiles.photo.path)
            assertFalse("parts are painted", shown.sameAs(original))
            fun shownAfter(words: String, picture: File?): Bitmap {
                if (picture != null) answer(photo, picture)
                until(photo, words) { picture(photo).contentDescription.contains(words) && " in " in sentence(photo) }
                return (picture(photo).drawable as BitmapDrawable).bitmap
            }
            button(photo, "Try on").performClick()
            val dressed = shownAfter("dressed by a picture", null)
            assertFalse(dressed.sameAs(shown))
            button(photo, "Body parts").performClick()
            assertTrue(shownAfter("painted by body part", null).sameAs(shown))
            button(photo, "Wear a picture").performClick()
            assertFalse("another outfit", shownAfter("dressed by a picture", TestFiles.photo).sameAs(dressed))
        }

    @Test
    fun photosBecomeAHeadThatTurnsAndIsSaved() =
        TestFiles.inNewFolder { folder ->
            screen(HeadOfFile::class.java) { head ->
                button(head, "To the left").performClick() // no head yet: nothing to turn
                button(head, "Save").performClick()
                answer(head, File(folder, "none.glb"))
                until(head, "what is missing") { sentence(head).startsWith("There is no head yet") }
                assertFalse(File(folder, "none.glb").exists())

                button(head, "Choose").performClick()
                answer(head, TestFiles.photo)
                until(head, "the head while it forms") { picture(head).contentDescription.contains("not finished") }
                until(head, "a head") { sentence(head).startsWith("A head from 1 photo.") }
                fun shownAfter(text: String, degrees: Int): Bitmap {
                    val before = (picture(head).drawable as BitmapDrawable).bitmap
                    button(head, text).performClick()
                    until(head, text) { !(picture(head).drawable as BitmapDrawable).bitmap.sameAs(before) }
                    assertEquals("The head, turned by $degrees degrees", picture(head).contentDescription)
                    return (picture(head).drawable as BitmapDrawable).bitmap
                }
                until(head, "its picture") { picture(head).contentDescription.contains("turned by -17 degrees") }
                val left = (picture(head).drawable as BitmapDrawable).bitmap
                shownAfter("To the right", 0)
                assertFalse("from the front", shownAfter("To the right", 17).sameAs(left))
                shownAfter("Show the shape", 17)
                shownAfter("Show colours", 17)

                button(head, "Save").performClick()
                val asked = shadowOf(head).peekNextStartedActivityForResult().intent
                assertEquals(Intent.ACTION_CREATE_DOCUMENT, asked.action)
                answer(head, File(folder, "head.glb"))
                until(head, "the file") { sentence(head).startsWith("Saved.") }
                assertEquals("glTF", File(folder, "head.glb").readBytes().decodeToString(0, 4))
                assertEquals("only for a while", emptyList<String>(), head.cacheDir.list()!!.filter { "glb" in it })

                button(head, "Add a photo").performClick()
                answer(head, TestFiles.photo)
                until(head, "a head of both") { sentence(head).startsWith("A head from 2 photos.") }

                val grey = Bitmap.createBitmap(300, 300, Bitmap.Config.ARGB_8888)
                val file = File(folder, "grey.png")
                file.outputStream().use { grey.compress(Bitmap.CompressFormat.PNG, 100, it) }
                button(head, "Add a photo").performClick()
                answer(head, file)
                until(head, "that there is none") { sentence(head).startsWith("No head is seen") }
                shownAfter("To the left", 0)
            }
        }

    @Test
    fun aDamagedSceneIsASentence() =
        TestFiles.inNewFolder { folder ->
            screen(SceneOfFile::class.java) { scene ->
                button(scene, "Choose").performClick()
                answer(scene, File(folder, "scene.maqs").apply { writeText("no scene") })
                until(scene, "the reason") { sentence(scene).contains("scene") && sentence(scene) != "Opening …" }
            }
        }

    @Test
    fun aSceneIsSeenFromWhereTheButtonsMove() =
        TestFiles.inNewFolder { folder ->
            val file = File(folder, "room.maqs")
            Maquette().use { maquette ->
                maquette.openCapture(TestFiles.room.path).use { capture ->
                    val quick = SceneBuildConfig(longSidePx = 160, maxViews = 4, maxPoints = 40_000)
                    maquette.buildScene(capture, fromFolder("scenes-int8"), quick).use { it.save(file.path) }
                }
            }
            screen(SceneOfFile::class.java) { scene ->
                button(scene, "Choose").performClick()
                answer(scene, file)
                until(scene, "a view") { picture(scene).drawable != null }
                for (text in listOf("To the right", "To the left", "Nearer", "Farther")) {
                    val before = (picture(scene).drawable as BitmapDrawable).bitmap
                    button(scene, text).performClick()
                    until(scene, "another view") { !(picture(scene).drawable as BitmapDrawable).bitmap.sameAs(before) }
                }
            }
        }

    @Test
    fun aPlaceIsCapturedBuiltAndShown() {
        shadowOf(RuntimeEnvironment.getApplication()).grantPermissions(CAMERA)
        screen(CaptureOfRoom::class.java) { capture ->
            until(capture, "five photos") { sentence(capture).startsWith("5 photos") }
            assertTrue(picture(capture).contentDescription.contains("place"))
            button(capture, "Build").performClick()
            until(capture, "a scene") { sentence(capture).startsWith("Built") }
            val shown = shadowOf(capture).nextStartedActivity
            assertEquals(SceneActivity::class.java.name, shown.component!!.className)
            val controller = Robolectric.buildActivity(SceneOfFile::class.java, shown).setup()
            until(controller.get(), "a view") { picture(controller.get()).drawable != null }
            controller.pause().stop().destroy()
        }
    }

    @Test
    fun whereNothingKnowsTheCamerasPlaceTheScreenSaysSo() {
        shadowOf(RuntimeEnvironment.getApplication()).grantPermissions(CAMERA)
        screen(CaptureWithoutCamera::class.java) { capture ->
            until(capture, "the reason") { sentence(capture) == "This device has no ARCore: open a scene file." }
            assertFalse(button(capture, "Build").isEnabled)
        }
        shadowOf(RuntimeEnvironment.getApplication()).denyPermissions(CAMERA)
        screen(CaptureWithoutCamera::class.java) { assertTrue(sentence(it).startsWith("Allow the camera")) }
    }

    @Test
    fun anOrbitLooksAtTheMiddleWhicheverWayIsUp() {
        for (up in listOf(listOf(0.0, 0.0, 1.0), listOf(0.0, -1.0, 0.0), listOf(1.0, 0.0, 0.0))) {
            val bounds = listOf(-1.0, -2.0, -3.0) to listOf(3.0, 2.0, 1.0)
            val orbit = Orbit.around(Scene.Info(8, 1, 0, 1, up, bounds.first, bounds.second, ""))
            for (angle in listOf(0.0, 2.0)) {
                val camera = orbit.moved(angle, 0.2).camera(64, 48)
                val rows = camera.rotation.chunked(3).map(Vector::of)
                val seen = Vector(1.0, 0.0, -1.0) - Vector.of(camera.centre)
                assertEquals(0.0, rows[0] dot seen, 1e-9)
                assertEquals(0.0, rows[1] dot seen, 1e-9)
                assertEquals(orbit.radius, rows[2] dot seen, 1e-9)
                assertEquals("right-handed", 1.0, (rows[0] cross rows[1]) dot rows[2], 1e-9)
                assertTrue("up is up in the picture", rows[1] dot Vector.of(up) < 0)
            }
        }
    }

    @Test
    fun theBenchmarkGivesTheReportOfTheCommandLine() =
        screen(ShortBenchmark::class.java) { bench ->
            assertFalse(button(bench, "Save").isEnabled)
            button(bench, "Measure").performClick()
            until(bench, "a result") { sentence(bench).contains("pictures a second") }
            button(bench, "Save").performClick()
            assertEquals(Intent.ACTION_CREATE_DOCUMENT, shadowOf(bench).nextStartedActivityForResult.intent.action)
            Maquette().use { maquette ->
                val report = Benchmark(maquette, fromFolder("densepose-b-int8")).run(listOf(TestFiles.photo.path), 11)
                assertEquals("maquette-bench-3", report.getString("schema"))
                val case = report.getJSONArray("cases").getJSONObject(0)
                assertEquals(11, case.getInt("runs"))
                assertEquals(1.0, case.getDouble("people"), 0.0)
                val frame = case.getJSONObject("ms").getJSONObject("frame")
                assertTrue(frame.getDouble("p50") > case.getJSONObject("ms").getJSONObject("trunk").getDouble("p50"))
                assertTrue(frame.getDouble("p50") <= frame.getDouble("p99"))
            }
        }
}
