package dev.maquette

import java.io.File
import kotlin.math.abs
import org.junit.Assert.assertEquals
import org.junit.Assert.assertNotNull
import org.junit.Assert.assertNull
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

class BodyTest : AndroidTest() {
    private val bundle = ModelBundle.ofFolder(TestFiles.bodyBundle.path)

    /** Runs [work] with the dense pose of the photo, which shows one person from the front. */
    private fun withPeople(
        config: DensePose.Config = DensePose.Config(),
        work: (Maquette, Body, DensePoseResult) -> Unit,
    ) =
        Maquette().use { maquette ->
            maquette.decode(TestFiles.photo.readBytes()).use { frame ->
                maquette.densePose(ModelBundle.ofFolder(TestFiles.bundle.path), config).use { densePose ->
                    densePose.run(frame).use { people ->
                        maquette.body(bundle, Body.Config(resultPoolSize = 2)).use { work(maquette, it, people) }
                    }
                }
            }
        }

    private fun camera(people: DensePoseResult) =
        Intrinsics(people.widthPx, people.heightPx, 700.0, 700.0, 255.5, 255.5, List(8) { 0.0 })

    @Test
    fun aPersonHasMeshAnglesAndSizesThatStay() =
        withPeople { _, body, people ->
            val mesh = body.mesh
            assertEquals("pelvis", mesh.jointNames.first())
            assertEquals(-1, mesh.jointParents.first())
            assertEquals(mesh.jointNames.size, mesh.jointParents.size)
            assertTrue(mesh.triangles.all { it in 0 until mesh.vertexCount })
            val result = body.run(people)
            val person = result.use { it.people.first()!! }
            assertEquals(BodyResult.Fit.FITTED, result.fits.first())
            assertEquals(people.people.first().id, person.id)
            assertTrue(person.inlierFraction > 0.6f && person.errorPx > 0 && person.iterations > 0)
            assertNull(person.pelvisM)
            assertTrue(person.scalePxPerM > 100)
            assertEquals(BodyPerson.Angle.entries.toSet(), person.anglesDeg.keys)
            assertTrue(person.anglesDeg.values.all { it in -180f..180f })
            assertEquals(3 * mesh.vertexCount, person.verticesM.size)
            assertTrue(person.verticesM.all { abs(it) < 2 })
            assertEquals(99, person.keypointsM.size)
            assertTrue("the nose is above the pelvis", person.keypointsM[1] < -0.4f)
            assertTrue("the left shoulder is at the right", person.keypointsM[33] > person.keypointsM[36] + 0.15f)
            assertEquals(mesh.jointNames.size, person.seenJoints.size)
            assertTrue(person.seenJoints[mesh.jointNames.indexOf("head")])
            assertTrue(person.shape.size == mesh.shapeCount && person.shape.all { abs(it) <= 3 })
            val sizes = person.sizes
            assertTrue(!sizes.isHeightKnown)
            for (size in listOf(sizes.height, sizes.chest, sizes.waist, sizes.hip, sizes.inseam)) {
                assertTrue("$size", 0.3f < size.lowM && size.lowM < size.valueM && size.valueM < size.highM && size.highM < 2.6f)
            }
        }

    @Test
    fun aHeightAndACameraGiveMetres() =
        withPeople { _, body, people ->
            val (small, tall) = listOf(1.5f, 2f).map { height ->
                val heights = List(people.people.size) { height }
                body.run(people, camera(people), heightsM = heights).use { it.people.first()!! }
            }
            for ((person, height) in listOf(small to 1.5f, tall to 2f)) {
                assertTrue(person.sizes.isHeightKnown)
                assertEquals(height, person.sizes.height.valueM, 1e-4f)
                assertEquals(person.sizes.height.lowM, person.sizes.height.highM, 0f)
                assertEquals(700f / person.pelvisM!![2], person.scalePxPerM, 1f)
            }
            // Not quite the ratio of the heights: a smaller body has other proportions, and the photo shows the trunk.
            assertEquals(2 / 1.5, (tall.pelvisM!![2] / small.pelvisM!![2]).toDouble(), 0.15)
            assertTrue(tall.sizes.inseam.valueM > small.sizes.inseam.valueM + 0.15f)
        }

    @Test
    fun aClipIsWrittenAsGlbAndBvh() =
        withPeople(DensePose.Config(hasKeypoints = true)) { _, body, people ->
            BodyClip(body).use { clip ->
                TestFiles.inNewFolder { folder ->
                    failure(Status.NOT_FOUND) { clip.save(File(folder, "none.glb").path) }
                    for (frame in 0L..3L) body.run(people, timestampNs = frame * 33_000_000).use(clip::add)
                    assertEquals(people.people.size, clip.personCount)
                    clip.save(File(folder, "a.glb").path)
                    clip.savePerson(0, File(folder, "a.bvh").path)
                    assertEquals("glTF", File(folder, "a.glb").readBytes().decodeToString(0, 4))
                    assertTrue("Frames: 4" in File(folder, "a.bvh").readText())
                    failure(Status.INVALID_ARGUMENT) { clip.save(File(folder, "a.bvh").path) }
                    failure(Status.INVALID_ARGUMENT) { clip.savePerson(9, File(folder, "b.bvh").path) }
                }
            }
        }

    @Test
    fun laterFramesOfAStreamStartFromTheBodyBefore() =
        withPeople { _, body, people ->
            fun iterations(timeNs: Long) = body.run(people, timestampNs = timeNs).use { it.people.first()!!.iterations }
            val first = iterations(0)
            assertTrue(iterations(33_000_000) < first)
            body.reset()
            assertEquals(first, iterations(66_000_000))
        }

    @Test
    fun wrongInputIsExplained() =
        withPeople { maquette, body, people ->
            val heights = List(people.people.size) { 0.9f }
            assertTrue("heights_m[0]" in failure(Status.INVALID_ARGUMENT) { body.run(people, heightsM = heights) })
            assertThrows(IllegalArgumentException::class.java) { body.run(people, heightsM = emptyList()) }
            val other = camera(people).copy(widthPx = 100)
            assertTrue("100" in failure(Status.INVALID_ARGUMENT) { body.run(people, other) })
            val held = List(2) { body.run(people) }
            failure(Status.POOL_EMPTY) { body.run(people) }
            held.forEach(BodyResult::close)
            maquette.body(bundle).use { second ->
                BodyClip(second).use { clip ->
                    body.run(people).use { assertTrue("two bodies" in failure(Status.INVALID_ARGUMENT) { clip.add(it) }) }
                }
            }
            failure(Status.UNSUPPORTED) { maquette.body(ModelBundle.ofFolder(TestFiles.bundle.path)) }
            failure(Status.NOT_FOUND) { maquette.body(ModelBundle.ofFolder("/nowhere")) }
            val result = body.run(people)
            body.close()
            assertClosed { body.run(people) }
            assertNotNull(result.people.first()) // results outlive the body
            result.close()
        }

    @Test
    fun nobodyIsAnEmptyResultAndABundleInMemoryGivesTheSame() =
        withPeople { maquette, body, people ->
            val buffers = ModelBundle.ofBuffers(TestFiles.bundleInMemory(TestFiles.bodyBundle))
            val (own, other) = listOf(body, maquette.body(buffers)).map { model ->
                model.run(people).use { it.people.first()!!.verticesM.toList() }
            }
            assertEquals(own, other)
            maquette.source("stub:pattern?size=320x240").use { source ->
                source.acquireFrame()!!.use { frame ->
                    maquette.densePose(ModelBundle.ofFolder(TestFiles.bundle.path)).use { densePose ->
                        densePose.run(frame).use { nobody ->
                            assertTrue(nobody.people.isEmpty())
                            body.run(nobody).use { assertTrue(it.people.isEmpty() && it.fits.isEmpty()) }
                        }
                    }
                }
            }
        }
}
