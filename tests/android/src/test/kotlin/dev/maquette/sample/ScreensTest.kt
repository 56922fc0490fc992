package dev.maquette.sample

import android.app.Activity
import android.graphics.Color
import android.view.View
import android.view.ViewGroup
import android.widget.Button
import android.widget.ImageView
import android.widget.TextView
import dev.maquette.AndroidTest
import java.io.File
import javax.xml.parsers.DocumentBuilderFactory
import org.junit.Assert.assertEquals
import org.junit.Assert.assertTrue
import org.junit.Test
import org.robolectric.Robolectric
import org.robolectric.RuntimeEnvironment
import org.w3c.dom.Element

/** Checks that hold for every screen: with a screen reader, with thumbs, with large letters, at night. */
class ScreensTest : AndroidTest() {
    private val screens =
        listOf(
            MainActivity::class.java,
            LiveActivity::class.java,
            PhotoActivity::class.java,
            HeadActivity::class.java,
            CaptureWithoutCamera::class.java,
            SceneActivity::class.java,
            BenchmarkActivity::class.java,
        )

    private fun onEach(qualifiers: String = "", test: (Activity, List<View>) -> Unit) {
        fun below(view: View): List<View> =
            listOf(view) + if (view is ViewGroup) List(view.childCount, view::getChildAt).flatMap(::below) else listOf()
        for (type in screens) {
            if (qualifiers.isNotEmpty()) RuntimeEnvironment.setQualifiers(qualifiers)
            val controller = Robolectric.buildActivity(type).setup()
            test(controller.get(), below(controller.get().findViewById(android.R.id.content)))
            controller.pause().stop().destroy()
        }
    }

    @Test
    fun whatIsTouchedIsLargeEnoughAndHasWords() {
        // A small phone with large letters, and one on its side.
        for ((qualifiers, letters) in listOf("w320dp-h480dp-port-mdpi" to 2f, "w640dp-h320dp-land-xhdpi" to 1f)) {
            RuntimeEnvironment.setFontScale(letters)
            onEach(qualifiers) { screen, views ->
                val dp = screen.resources.displayMetrics.density
                val where = "${screen.javaClass.simpleName} at $qualifiers"
                val touched = views.filter { it.isClickable }
                assertTrue(where, touched.isNotEmpty())
                for (view in touched) {
                    val words = (view as TextView).text
                    assertTrue("$where: nameless", words.isNotBlank())
                    assertTrue("$where: $words is ${view.height / dp} dp high", view.height >= 48 * dp)
                    assertTrue("$where: $words is ${view.width / dp} dp wide", view.width >= 48 * dp)
                    val space = view.height - view.compoundPaddingTop - view.compoundPaddingBottom
                    assertTrue("$where: a line of $words is cut", view.layout.height <= space)
                }
                val picture = views.filterIsInstance<ImageView>().singleOrNull() ?: return@onEach
                assertEquals(where, "No picture yet", picture.contentDescription)
            }
        }
    }

    @Test
    fun theSentenceIsSaidWheneverItChanges() =
        onEach { _, views ->
            val sentence = views.first { it is TextView && it !is Button }
            assertEquals(View.ACCESSIBILITY_LIVE_REGION_POLITE, sentence.accessibilityLiveRegion)
            assertTrue((sentence as TextView).text.isNotBlank())
        }

    @Test
    fun screensAreDarkAtNightAndLettersStandOut() {
        for ((qualifiers, isDark) in listOf("notnight" to false, "night" to true)) {
            onEach(qualifiers) { screen, views ->
                val background = screen.theme.obtainStyledAttributes(intArrayOf(android.R.attr.colorBackground))
                val behind = luminance(background.getColor(0, Color.MAGENTA))
                val letters = luminance((views.first { it is TextView && it !is Button } as TextView).currentTextColor)
                assertEquals("${screen.javaClass.simpleName}, $qualifiers", isDark, behind < 0.2)
                // WCAG 2.1, contrast of at least 4.5 : 1.
                val contrast = (maxOf(behind, letters) + 0.05) / (minOf(behind, letters) + 0.05)
                assertTrue("$contrast, $qualifiers", contrast > 4.5)
            }
        }
    }

    private fun luminance(colour: Int) = Color.luminance(colour).toDouble()

    @Test
    fun theAppHasNoWayToSendAnythingAndSaysSo() {
        val file = File(System.getProperty("maquette.root")!!, "android/sample/src/main/AndroidManifest.xml")
        val document = DocumentBuilderFactory.newInstance().newDocumentBuilder().parse(file)
        fun elements(tag: String): List<Element> {
            val found = document.getElementsByTagName(tag)
            return List(found.length) { found.item(it) as Element }
        }
        fun nameOf(element: Element) = element.getAttribute("android:name")
        val permissions = elements("uses-permission").groupBy({ it.getAttribute("tools:node") }, ::nameOf)
        assertEquals(listOf("android.permission.CAMERA"), permissions[""])
        // Also where a library asks for it.
        assertTrue("android.permission.INTERNET" in permissions["remove"]!!)
        onEach { screen, views ->
            val sentence = (views.first { it is TextView } as TextView).text
            if (screen is MainActivity) assertTrue(sentence.toString(), "nothing is sent anywhere" in sentence)
        }
        val declared = elements("activity").map { nameOf(it).removePrefix(".") }
        val sources = file.parentFile.parentFile.walk()
        val written = sources.map { it.nameWithoutExtension }.filter { it.endsWith("Activity") }
        assertEquals((written - "CaptureActivity").toSet(), declared.toSet())
    }
}
