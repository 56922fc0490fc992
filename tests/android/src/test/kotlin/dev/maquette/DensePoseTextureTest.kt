package dev.maquette

import org.junit.Assert.assertEquals
import org.junit.Assert.assertNull
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

class DensePoseTextureTest : AndroidTest() {
    private fun withPhoto(work: (Maquette, Frame, DensePoseResult) -> Unit) =
        Maquette().use { maquette ->
            maquette.decode(TestFiles.photo.readBytes()).use { frame ->
                maquette.densePose(ModelBundle.ofFolder(TestFiles.bundle.path)).use { densePose ->
                    densePose.run(frame).use { work(maquette, frame, it) }
                }
            }
        }

    @Test
    fun aPhotoFillsPartOfTheTexture() =
        withPhoto { maquette, frame, people ->
            maquette.densePoseTexture(tilePx = 16).use { texture ->
                assertEquals(64, texture.widthPx)
                assertEquals(96, texture.heightPx)
                val seen = { texture.copyRgba().filterIndexed { i, alpha -> i % 4 == 3 && alpha != 0.toByte() }.size }
                assertEquals(0, seen())
                texture.addPerson(people, 0, frame)
                assertTrue("${seen()} texels", seen() in 300..4000)
                val wrong = assertThrows(MaquetteException::class.java) { texture.addPerson(people, 9, frame) }
                assertEquals(Status.INVALID_ARGUMENT, wrong.status)
            }
            assertThrows(MaquetteException::class.java) { maquette.densePoseTexture(tilePx = 7) }
        }

    @Test
    fun pixelsAreFoundFromPointsOfTheSurface() =
        withPhoto { _, _, people ->
            val part = people.copyPlane(DensePoseResult.Plane.PART)
            val person = people.copyPlane(DensePoseResult.Plane.PERSON)
            val u = people.copyPlane(DensePoseResult.Plane.U)
            val v = people.copyPlane(DensePoseResult.Plane.V)
            val at = person.indices.filter { person[it] == 1.toByte() }.let { it[it.size / 2] }
            val unit = { value: Byte -> (value.toInt() and 255) / 255f }
            val found = people.findPixel(0, part[at].toInt(), unit(u[at]), unit(v[at]))!!
            assertEquals(0f, found.distance, 1e-5f)
            assertEquals(part[at], part[found.yPx.toInt() * people.widthPx + found.xPx.toInt()])
            val missing = (1..24).filter { number -> part.indices.none { person[it] == 1.toByte() && part[it].toInt() == number } }
            for (number in missing) assertNull(people.findPixel(0, number, 0.5f, 0.5f))
            assertThrows(MaquetteException::class.java) { people.findPixel(0, 25, 0.5f, 0.5f) }
        }
}
