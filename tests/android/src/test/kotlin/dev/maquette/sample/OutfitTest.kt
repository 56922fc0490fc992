package dev.maquette.sample

import android.graphics.Bitmap
import android.graphics.Color
import dev.maquette.AndroidTest
import dev.maquette.BodySurface
import dev.maquette.DensePoseResult
import dev.maquette.Maquette
import dev.maquette.ModelBundle
import dev.maquette.TestFiles
import org.junit.Assert.assertEquals
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

class OutfitTest : AndroidTest() {
    private fun bitmap(width: Int, height: Int, colour: (x: Int, y: Int) -> Int): Bitmap {
        val pixels = IntArray(width * height) { colour(it % width, it / width) }
        return Bitmap.createBitmap(pixels, width, height, Bitmap.Config.ARGB_8888).copy(Bitmap.Config.ARGB_8888, true)
    }

    private fun ofPhoto(test: (DensePoseResult, BodySurface) -> Unit) =
        Maquette().use { maquette ->
            maquette.densePose(ModelBundle.ofFolder(TestFiles.bundle.path)).use { densePose ->
                maquette.decode(TestFiles.photo.readBytes()).use { frame ->
                    densePose.run(frame).use { test(it, densePose.surface()!!) }
                }
            }
        }

    /** Compares each dressed pixel with `expected`, or skips it where that is null; the picture was `grey` before. */
    private fun compare(
        people: DensePoseResult,
        outfit: Outfit,
        grey: Int,
        expected: (part: Int, u: Float, v: Float) -> List<Float>?,
    ) {
        val picture = bitmap(people.widthPx, people.heightPx) { _, _ -> Color.rgb(grey, grey, grey) }
        outfit.dress(picture, people)
        val planes = DensePoseResult.Plane.entries.map(people::copyPlane)
        val light = 0.65f + 0.6f * grey / 255
        var compared = 0
        for (i in planes[0].indices step 7) {
            val pixel = picture.getPixel(i % people.widthPx, i / people.widthPx)
            val seen = listOf(Color.red(pixel), Color.green(pixel), Color.blue(pixel))
            val part = planes[0][i].toInt()
            if (part == 0) {
                assertEquals(List(3) { grey }, seen)
                continue
            }
            val worn = expected(part, planes[1][i].toUByte().toFloat() / 255, planes[2][i].toUByte().toFloat() / 255)
            worn?.zip(seen) { a, b -> assertEquals("part $part", minOf(255f, a * light), b.toFloat(), 4f) }
            compared += if (worn == null) 0 else 1
        }
        assertTrue("$compared pixels", compared > 3000)
    }

    @Test
    fun anAtlasDressesEachPartInItsChart() =
        ofPhoto { people, _ ->
            // Red tells the chart, green U and blue 1 - V.
            val atlas = bitmap(256, 384) { x, y -> Color.rgb((x / 64 * 6 + y / 64) * 8, x % 64 * 3, y % 64 * 3) }
            val outfit = Outfit(atlas, null)
            for (grey in listOf(0, 145, 255)) {
                compare(people, outfit, grey) { part, u, v ->
                    val (x, y) = (u * 64).coerceIn(0.5f, 63.5f) to ((1 - v) * 64).coerceIn(0.5f, 63.5f)
                    listOf((part - 1) * 8f, (x - 0.5f) * 3, (y - 0.5f) * 3)
                }
            }
        }

    @Test
    fun aPictureIsRepeatedAroundTheBody() =
        ofPhoto { people, surface ->
            // A period of colours that go up and down, so that the seam has no step.
            fun wave(at: Float) = 200 * (1 - kotlin.math.abs(1 - 2 * (at - kotlin.math.floor(at))))
            val (width, height) = 400 to 300
            val picture = bitmap(width, height) { x, y ->
                Color.rgb(wave((x + 0.5f) / width).toInt(), wave((y + 0.5f) / height).toInt(), 0)
            }
            compare(people, Outfit(picture, surface), 145) { part, u, v ->
                surface.pointAt(part, u, v)?.let { (x, y, z) ->
                    val across = if (y < 0) x else -x
                    // Between two nodes in front and behind the picture jumps.
                    if (kotlin.math.abs(y) < 0.03f) null
                    else listOf(wave(0.5f + across / 0.45f), wave((1.45f - z) / 0.45f * width / height), 0f)
                }
            }
            val error = assertThrows(IllegalArgumentException::class.java) { Outfit(picture, null) }
            assertTrue(error.message, "atlas" in error.message!!)
        }
}
