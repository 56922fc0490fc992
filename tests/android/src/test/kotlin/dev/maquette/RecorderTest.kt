package dev.maquette

import java.io.File
import java.nio.ByteBuffer
import kotlin.math.abs
import org.junit.Assert.assertArrayEquals
import org.junit.Assert.assertEquals
import org.junit.Assert.assertTrue
import org.junit.Test

class RecorderTest : AndroidTest() {
    private val maquette = Maquette()

    private fun Frame.rgb(): ByteArray {
        val pixels = ByteBuffer.allocateDirect(3 * widthPx * heightPx)
        copyPixels(PixelFormat.RGB8, pixels)
        return ByteArray(pixels.capacity()).also { pixels.get(it) }
    }

    @Test
    fun whatIsRecordedIsPlayedWithItsPixelsAndTimes() = TestFiles.inNewFolder { folder ->
        val stub = "stub:people?size=64x48&fps=10&seed=3&frames=5"
        for (quality in listOf(0, 90)) {
            val file = File(folder, "täke $quality.maqrec")
            val expected = maquette.source(stub).use { source ->
                maquette.recorder(file.path, source, quality).use { recorder ->
                    assertEquals(0L, recorder.info.frameCount)
                    val frames = generateSequence { source.acquireFrame() }
                    val seen = frames.onEach(recorder::add).map { it.use { frame -> frame.timestampNs to frame.rgb() } }
                    seen.toList().also {
                        val bytes = recorder.info.sizeBytes
                        recorder.finish()
                        assertTrue("an index is added", file.length() > bytes)
                        assertEquals(Recorder.Info(5, file.length()), recorder.info)
                    }
                }
            }
            maquette.source("rec:${file.path}").use { source ->
                assertEquals(10.0, source.info.fps, 1e-6)
                for ((time, pixels) in expected) {
                    source.acquireFrame()!!.use { frame ->
                        assertEquals(time, frame.timestampNs)
                        val levels = frame.rgb().zip(pixels) { a, b -> abs(a.toUByte().toInt() - b.toUByte().toInt()) }
                        assertTrue("${levels.average()}", levels.average() < if (quality == 0) 1e-9 else 8.0)
                    }
                }
                assertEquals(null, source.acquireFrame())
            }
        }
    }

    @Test
    fun framesOfTheAppAreRecordedAndAWrongOneLosesNothing() = TestFiles.inNewFolder { folder ->
        val file = File(folder, "own.maqrec")
        fun frame(side: Int, timeNs: Long) = maquette.frame(
            PixelFormat.GREY8, side, side, Plane(ByteBuffer.allocateDirect(side * side)), timestampNs = timeNs,
        )
        val recorder = maquette.recorder(file.path)
        frame(8, 10).use(recorder::add)
        failure(Status.INVALID_ARGUMENT) { frame(8, 10).use(recorder::add) }
        frame(16, 20).use(recorder::add)
        recorder.finish()
        recorder.close()
        assertClosed { recorder.info }
        assertClosed { frame(8, 30).use(recorder::add) }
        maquette.source("rec:${file.path}").use { source ->
            val sides = generateSequence { source.acquireFrame() }.map { it.use(Frame::widthPx) }.toList()
            assertEquals(listOf(8, 16), sides)
        }
        failure(Status.UNWRITABLE) { maquette.recorder(file.path) }
        failure(Status.UNWRITABLE) { maquette.recorder(File(folder, "no/own.maqrec").path) }
        failure(Status.INVALID_ARGUMENT) { maquette.recorder(File(folder, "a.maqrec").path, jpegQuality = 101) }
        maquette.recorder(File(folder, "empty.maqrec").path).close()
        assertEquals(setOf("own.maqrec"), folder.list()!!.toSet())
    }

    @Test
    fun resultsAndPicturesAreSavedAsFiles() = TestFiles.inNewFolder<Unit> { folder ->
        maquette.densePose(ModelBundle.ofFolder(TestFiles.bundle.path)).use { densePose ->
            maquette.decode(TestFiles.photo.readBytes()).use { frame ->
                densePose.run(frame).use { result ->
                    result.save(File(folder, "föto").path)
                    val names = setOf("föto_IUV.png", "föto_INDS.png", "föto.json")
                    assertEquals(names, folder.list()!!.toSet())
                    val planes = listOf(DensePoseResult.Plane.V, DensePoseResult.Plane.U, DensePoseResult.Plane.PART)
                    maquette.decode(File(folder, "föto_IUV.png").readBytes()).use { iuv ->
                        val rgb = iuv.rgb()
                        for ((channel, plane) in planes.withIndex()) {
                            val expected = result.copyPlane(plane)
                            assertArrayEquals("$plane", expected, ByteArray(expected.size) { rgb[3 * it + channel] })
                        }
                    }
                    maquette.decode(File(folder, "föto_INDS.png").readBytes()).use { people ->
                        val rgb = people.rgb()
                        val expected = result.copyPlane(DensePoseResult.Plane.PERSON)
                        assertArrayEquals(expected, ByteArray(expected.size) { rgb[3 * it] })
                    }
                    val json = org.json.JSONObject(File(folder, "föto.json").readText())
                    assertEquals(frame.widthPx, json.getInt("width"))
                    val box = json.getJSONArray("people").getJSONObject(0).getJSONArray("box")
                    assertEquals(result.people[0].left.toDouble(), box.getDouble(0), 0.006)
                    failure(Status.INVALID_ARGUMENT) { result.save(folder.path + "/") }
                    failure(Status.UNWRITABLE) { result.save(File(folder, "no/föto").path) }
                }
                val picture = File(folder, "phöto.png")
                frame.save(picture.path)
                maquette.decode(picture.readBytes()).use { assertArrayEquals(frame.rgb(), it.rgb()) }
                failure(Status.INVALID_ARGUMENT) { frame.save(File(folder, "photo.gif").path) }
                failure(Status.UNWRITABLE) { frame.save(File(folder, "no/photo.png").path) }
            }
        }
    }

    @Test
    fun theBodySurfaceIsOneBodyWhicheverWayItIsAskedFor() {
        val bundle = ModelBundle.ofFolder(TestFiles.bundle.path)
        val surface = maquette.densePose(bundle).use { it.surface()!! }
        val points = surface.copyPoints()
        assertEquals(24 * surface.nodes * surface.nodes * 3, points.size)
        val heights = List(points.size / 3) { points[3 * it + 2] }.filterNot(Float::isNaN)
        assertTrue("${heights.min()} to ${heights.max()} m", heights.min() in -0.1f..0.1f && heights.max() in 1.5f..2f)
        // Between two nodes lies their mean, and part 24 is above part 6 (the head, a foot).
        val step = 1f / (surface.nodes - 1)
        for (part in 1..24) for (u in 0 until surface.nodes - 1) for (v in 0 until surface.nodes) {
            val (a, b) = List(2) { surface.pointAt(part, (u + it) * step, v * step) }
            if (a == null || b == null) continue
            val middle = surface.pointAt(part, (u + 0.5f) * step, v * step)!!
            for (axis in 0..2) assertEquals((a[axis] + b[axis]) / 2, middle[axis], 1e-3f)
        }
        fun meanHeight(part: Int): Double {
            val of = points.toList().chunked(points.size / 24)[part - 1].chunked(3)
            return of.map { it[2] }.filterNot(Float::isNaN).average()
        }
        assertTrue(meanHeight(24) > meanHeight(6) + 1)
        failure { surface.pointAt(25, 0f, 0f) }
        maquette.pipeline(bundle).use { pipeline ->
            assertEquals(null, pipeline.surface())
            pipeline.setSource("image:${TestFiles.photo.path}")
            pipeline.acquireResult()!!.close()
            assertArrayEquals(points, pipeline.surface()!!.copyPoints(), 0f)
        }
    }

    private fun failure(work: () -> Unit) =
        org.junit.Assert.assertThrows(IllegalArgumentException::class.java) { work() }
}
