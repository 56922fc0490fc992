package dev.maquette

import android.graphics.Bitmap
import android.graphics.Color
import java.nio.ByteBuffer
import kotlin.concurrent.thread
import org.junit.Assert.assertArrayEquals
import org.junit.Assert.assertEquals
import org.junit.Assert.assertFalse
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

class DensePoseTest : AndroidTest() {
    private fun black(maquette: Maquette, width: Int, height: Int) =
        maquette.frame(PixelFormat.RGB8, width, height, Plane(ByteBuffer.allocateDirect(3 * width * height)))

    @Test
    fun aPhotoHasOnePersonWhateverWayTheBundleComes() {
        Maquette().use { maquette ->
            assertTrue(maquette.onnxRuntimeVersion.startsWith("1."))
            val bundles = listOf(
                ModelBundle.ofFolder(TestFiles.bundle.path),
                ModelBundle.ofBuffers(TestFiles.bundleInMemory()),
            )
            val parts = bundles.map { bundle ->
                maquette.densePose(bundle).use { densePose ->
                    maquette.decode(TestFiles.photo.readBytes()).use { frame ->
                        densePose.run(frame).use { result ->
                            assertEquals(frame.widthPx, result.widthPx)
                            assertEquals(frame.heightPx, result.heightPx)
                            val person = result.people.single()
                            assertTrue(person.score > 0.9f)
                            assertTrue(person.left < person.right && person.top < person.bottom)
                            val part = result.copyPlane(DensePoseResult.Plane.PART)
                            val people = result.plane(DensePoseResult.Plane.PERSON)
                            assertTrue(people.isReadOnly)
                            assertEquals(result.stats.bodyPixels, part.count { it > 0 }.toLong())
                            for (k in part.indices) assertEquals(part[k] > 0, people[k] == 1.toByte())
                            assertEquals(1, result.stats.people)
                            assertTrue(result.stats.isKeyFrame && result.stats.totalMs > 0)
                            part
                        }
                    }
                }
            }
            assertTrue(parts[0].count { it > 0 } > 30_000)
            assertArrayEquals(parts[0], parts[1])
        }
    }

    @Test
    fun anOverlayHasTheColourOfEachPart() {
        Maquette().use { maquette ->
            maquette.densePose(ModelBundle.ofFolder(TestFiles.bundle.path)).use { densePose ->
                maquette.decode(TestFiles.photo.readBytes()).use { frame ->
                    densePose.run(frame).use { result ->
                        val parts = result.copyPlane(DensePoseResult.Plane.PART)
                        val overlay = result.overlay(opacity = 255)
                        assertEquals(result.widthPx to result.heightPx, overlay.width to overlay.height)
                        for (k in parts.indices step 97) {
                            val expected = DensePose.partColour(parts[k].toInt())
                            assertEquals(expected, overlay.getPixel(k % result.widthPx, k / result.widthPx))
                        }
                        val body = parts.indexOfFirst { it > 0 }
                        val pixel = result.overlay(100).getPixel(body % result.widthPx, body / result.widthPx)
                        assertEquals(100, Color.alpha(pixel))
                        assertThrows(IllegalArgumentException::class.java) { result.overlay(256) }
                        result.close()
                        assertEquals(result.widthPx, overlay.width)
                        assertThrows(IllegalStateException::class.java) { result.overlay() }
                    }
                }
            }
        }
    }

    @Test
    fun keypointsHaveNamesPlacesAndConfidences() {
        Maquette().use { maquette ->
            maquette.decode(TestFiles.photo.readBytes()).use { frame ->
                val bundle = ModelBundle.ofFolder(TestFiles.bundle.path)
                maquette.densePose(bundle).use { it.run(frame).use { result ->
                    assertTrue(result.people.single().keypoints.isEmpty())
                } }
                maquette.densePose(bundle, DensePose.Config(hasKeypoints = true)).use { it.run(frame).use { result ->
                    val keypoints = result.people.single().keypoints
                    assertEquals(33, keypoints.size)
                    assertEquals("left_wrist", keypoints[15].name)
                    val nose = keypoints.single { point -> point.name == "nose" }
                    assertTrue(nose.confidence > 0.3f)
                    val part = result.copyPlane(DensePoseResult.Plane.PART)
                    assertTrue(part[nose.y.toInt() * result.widthPx + nose.x.toInt()] in 23..24)
                    assertTrue(result.stats.keypointsMs > 0)
                } }
            }
        }
    }

    @Test
    fun framesAreWhatTheAppGave() {
        Maquette().use { maquette ->
            val bitmap = Bitmap.createBitmap(3, 2, Bitmap.Config.ARGB_8888)
            bitmap.setPixel(2, 1, Color.rgb(10, 20, 30))
            maquette.frame(bitmap, timestampNs = 5).use { frame ->
                assertEquals(PixelFormat.RGBA8, frame.format)
                assertEquals(5L, frame.timestampNs)
                val bgr = ByteBuffer.allocateDirect(3 * 3 * 2)
                frame.copyPixels(PixelFormat.BGR8, bgr)
                assertEquals(listOf<Byte>(30, 20, 10), (15..17).map { bgr[it] })
                assertEquals(Color.rgb(10, 20, 30), frame.toBitmap().getPixel(2, 1))
                frame.resize(6, 4).use { assertEquals(6 to 4, it.widthPx to it.heightPx) }
            }
            val y = ByteBuffer.allocateDirect(16 * 8)
            val uv = ByteBuffer.allocateDirect(16 * 4)
            maquette.frame(PixelFormat.NV12, 15, 8, Plane(y, 16), Plane(uv, 16), 9, Clock.MONOTONIC, 3).use { frame ->
                assertEquals(listOf<Any>(15, 8, PixelFormat.NV12, Clock.MONOTONIC, 9L, 3L), with(frame) {
                    listOf(widthPx, heightPx, format, clock, timestampNs, sequence)
                })
            }
        }
    }

    @Test
    fun wrongInputIsAnExceptionThatSaysWhatToDo() {
        Maquette().use { maquette ->
            val missing = failure(Status.NOT_FOUND) { maquette.densePose(ModelBundle.ofFolder("/no/bündle 🏃")) }
            assertTrue(missing, "bündle 🏃" in missing)
            val damaged = TestFiles.bundleInMemory().toMutableMap()
            damaged["trunk.onnx"] = TestFiles.direct(ByteArray(100))
            failure(Status.BAD_BUNDLE) { maquette.densePose(ModelBundle.ofBuffers(damaged)) }
            failure(Status.UNREADABLE) { maquette.decode(TestFiles.photo.readBytes().copyOf(1000)) }
            failure(Status.UNREADABLE) { maquette.decode(ByteArray(0)) }
            val pixels = ByteBuffer.allocateDirect(29)
            val short = failure(Status.INVALID_ARGUMENT) { maquette.frame(PixelFormat.RGB8, 5, 2, Plane(pixels)) }
            assertTrue(short, "30 bytes" in short)
            failure(Status.INVALID_ARGUMENT) { maquette.frame(PixelFormat.GREY8, 5, 2, Plane(ByteBuffer.allocate(29))) }
            failure(Status.INVALID_ARGUMENT) { maquette.frame(PixelFormat.NV12, 4, 4, Plane(pixels)) }
            failure(Status.INVALID_ARGUMENT) { maquette.frame(PixelFormat.GREY8, 5, 2, Plane(pixels, -5)) }
            val huge = 2_000_000_000
            failure(Status.INVALID_ARGUMENT) { maquette.frame(PixelFormat.GREY8, huge, huge, Plane(pixels)) }
            failure(Status.IMAGE_SIZE) { maquette.frame(PixelFormat.GREY8, 0, 2, Plane(pixels)) }
            maquette.frame(PixelFormat.GREY8, 5, 5, Plane(pixels)).use { frame ->
                failure(Status.INVALID_ARGUMENT) { frame.copyPixels(PixelFormat.RGBA8, ByteBuffer.allocateDirect(99)) }
            }
            val config = DensePose.Config(longSidePx = -1)
            failure(Status.INVALID_ARGUMENT) { maquette.densePose(ModelBundle.ofFolder(TestFiles.bundle.path), config) }
            val bitmap = Bitmap.createBitmap(3, 2, Bitmap.Config.RGB_565)
            assertThrows(IllegalArgumentException::class.java) { maquette.frame(bitmap) }
        }
    }

    @Test
    fun objectsAreClosedInAnyOrderAndNotUsedAfterwards() {
        val maquette = Maquette()
        val bundle = ModelBundle.ofFolder(TestFiles.bundle.path)
        val densePose = maquette.densePose(bundle, DensePose.Config(resultPoolSize = 1))
        val frame = maquette.decode(TestFiles.photo.readBytes())
        maquette.close()
        assertThrows(IllegalStateException::class.java) { maquette.decode(ByteArray(3)) }
        val result = densePose.run(frame)
        failure(Status.POOL_EMPTY) { densePose.run(frame) }
        frame.close()
        assertThrows(IllegalStateException::class.java) { densePose.run(frame) }
        densePose.close()
        assertEquals(1, result.people.size)
        assertTrue(result.copyPlane(DensePoseResult.Plane.U).any { it != 0.toByte() })
        result.close()
        result.close()
        assertThrows(IllegalStateException::class.java) { result.plane(DensePoseResult.Plane.U) }
        assertThrows(IllegalStateException::class.java) { densePose.cancel() }
    }

    @Test
    fun aRunIsCancelledFromAnotherThread() {
        Maquette().use { maquette ->
            maquette.densePose(ModelBundle.ofFolder(TestFiles.bundle.path)).use { densePose ->
                black(maquette, 64, 48).use { frame ->
                    densePose.cancel()
                    failure(Status.CANCELLED) { densePose.run(frame) }
                    densePose.run(frame).use { assertTrue(it.people.isEmpty()) }
                    densePose.reset()
                }
            }
        }
    }

    @Test
    fun tenThousandFramesAndAHundredNetworksLeaveNothing() {
        Maquette().use { maquette ->
            repeat(10_000) { black(maquette, 32, 24).close() }
            val bundle = ModelBundle.ofFolder(TestFiles.bundle.path)
            repeat(20) { maquette.densePose(bundle).close() }
            val before = residentMiB()
            repeat(80) { maquette.densePose(bundle).close() }
            assertTrue("${residentMiB() - before} MiB more after 80 networks", residentMiB() - before < 60)
        }
    }

    @Test
    fun framesThatAreForgottenGiveTheirBuffersBack() {
        Maquette().use { maquette ->
            val collector = thread { repeat(40) { System.gc(); Thread.sleep(5) } }
            // 6 GB in all: only garbage collection makes room for them. Java gives up after half a second, which is short
            // where collections are slow, since a buffer takes two: one for the frame, one for itself.
            var waits = 0
            repeat(2000) {
                while (true) {
                    try {
                        black(maquette, 1024, 1024).widthPx
                        break
                    } catch (error: OutOfMemoryError) {
                        if (++waits > 600) throw error
                        System.gc()
                        Thread.sleep(100)
                    }
                }
            }
            collector.join()
        }
    }

    @Test
    fun partsHaveNamesAndColours() {
        assertEquals("background", DensePose.partName(0))
        assertEquals(24, (1..24).map(DensePose::partName).toSet().size)
        assertEquals(0, DensePose.partColour(0))
        assertTrue((1..24).all { Color.alpha(DensePose.partColour(it)) == 255 })
        assertFalse(DensePose.partColour(1) == DensePose.partColour(2))
        assertEquals("0.3.0", Maquette.version)
    }
}
