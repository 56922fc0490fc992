package dev.maquette

import android.graphics.Bitmap
import android.hardware.HardwareBuffer
import android.hardware.HardwareBuffer.USAGE_CPU_READ_OFTEN
import android.hardware.HardwareBuffer.USAGE_CPU_WRITE_OFTEN
import android.hardware.HardwareBuffer.USAGE_GPU_SAMPLED_IMAGE
import java.nio.ByteBuffer
import org.junit.After
import org.junit.Assert.assertEquals
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

class HardwareBufferTest : AndroidTest() {
    private val maquette = Maquette()
    private val buffers = mutableListOf<HardwareBuffer>()

    private fun buffer(
        width: Int,
        height: Int,
        format: Int = HardwareBuffer.RGBA_8888,
        usage: Long = USAGE_CPU_READ_OFTEN or USAGE_CPU_WRITE_OFTEN,
    ) = HardwareBuffer.create(width, height, format, 1, usage).also(buffers::add)

    private fun rgba(frame: Frame): ByteBuffer =
        ByteBuffer.allocateDirect(4 * frame.widthPx * frame.heightPx).also {
            frame.copyPixels(PixelFormat.RGBA8, it)
        }

    /** 0xRRGGBB of a pixel of the buffer's memory. */
    private fun colour(memory: ByteBuffer, width: Int, x: Int, y: Int): Int {
        val at = 4 * (y * (width + 8) + x)
        return (0..2).fold(0) { all, i -> all shl 8 or (memory.get(at + i).toInt() and 0xFF) }
    }

    @After
    fun nothingIsLeft() {
        buffers.filterNot(HardwareBuffer::isClosed).forEach(HardwareBuffer::close)
        assertEquals("", FakeAndroid.misuse())
    }

    @Test
    fun aFrameIsTheBuffersOwnMemory() {
        val buffer = buffer(6, 4)
        val memory = FakeAndroid.memoryOf(buffer)
        maquette.frame(buffer, timestampNs = 7, clock = Clock.MONOTONIC, sequence = 3).use { frame ->
            buffer.close() // the frame keeps it
            assertEquals(listOf<Any>(6, 4, 7L, 3L), listOf<Any>(frame.widthPx, frame.heightPx, frame.timestampNs, frame.sequence))
            assertEquals(PixelFormat.RGBA8, frame.format)
            memory.put(0, 99) // as a renderer would that did not wait
            assertEquals(99, rgba(frame).get(0).toInt())
            assertEquals("a buffer is kept; a buffer is locked; ", FakeAndroid.misuse())
        }
    }

    @Test
    fun yuvBecomesNv12() {
        val buffer = buffer(16, 8, HardwareBuffer.YCBCR_420_888)
        FakeAndroid.memoryOf(buffer).apply { for (i in 0 until capacity()) put(i, 128.toByte()) }
        maquette.frame(buffer, rotationDegrees = 90).use { frame ->
            assertEquals(PixelFormat.NV12, frame.format)
            assertEquals(8 to 16, frame.widthPx to frame.heightPx)
            for (channel in 0..2) assertEquals(128f, (rgba(frame).get(channel).toInt() and 0xFF).toFloat(), 1f)
        }
    }

    @Test
    fun whatCannotBeReadIsASentence() {
        val ofGpu = failure(Status.INVALID_ARGUMENT) { maquette.frame(buffer(6, 4, usage = USAGE_GPU_SAMPLED_IMAGE)) }
        assertTrue(ofGpu, "USAGE_CPU_READ_OFTEN" in ofGpu)
        failure(Status.UNSUPPORTED) {
            maquette.frame(buffer(6, 4, usage = HardwareBuffer.USAGE_PROTECTED_CONTENT or USAGE_CPU_READ_OFTEN))
        }
        val of565 = failure(Status.UNSUPPORTED) { maquette.frame(buffer(6, 4, HardwareBuffer.RGB_565)) }
        assertTrue(of565, "RGBA_8888" in of565)
        failure(Status.INVALID_ARGUMENT) { maquette.frame(buffer(6, 4), rotationDegrees = 90) }
        val closed = buffer(6, 4).apply { close() }
        assertClosed { maquette.frame(closed) }
    }

    @Test
    fun framesAndPeopleAreDrawnIntoBuffersAndBitmapsOfTheApp() {
        val densePose = maquette.densePose(ModelBundle.ofFolder(TestFiles.bundle.path))
        maquette.decode(TestFiles.photo.readBytes()).use { frame ->
            densePose.run(frame).use { result ->
                val (width, height) = frame.widthPx to frame.heightPx
                val bitmap = Bitmap.createBitmap(width, height, Bitmap.Config.ARGB_8888)
                val buffer = buffer(width, height)
                val memory = FakeAndroid.memoryOf(buffer)
                val people = result.copyPlane(DensePoseResult.Plane.PART)
                val body = people.indices.first { people[it] != 0.toByte() }
                val ground = people.indices.first { people[it] == 0.toByte() }
                fun both(at: Int) = listOf(
                    bitmap.getPixel(at % width, at / width) and 0xFFFFFF,
                    colour(memory, width, at % width, at / width),
                )

                frame.copyTo(bitmap)
                frame.copyTo(buffer)
                val plain = listOf(body, ground).map { both(it)[0] }
                assertEquals(frame.toBitmap().getPixel(body % width, body / width) and 0xFFFFFF, plain[0])
                assertEquals(plain.map { listOf(it, it) }, listOf(body, ground).map(::both))

                result.draw(bitmap, frame, 255)
                result.draw(buffer, frame, 255)
                val painted = DensePose.partColour(people[body].toInt()) and 0xFFFFFF
                assertEquals(listOf(listOf(painted, painted), listOf(plain[1], plain[1])), listOf(body, ground).map(::both))

                result.draw(bitmap)
                assertEquals(0, bitmap.getPixel(ground % width, ground / width))
                assertEquals(180, bitmap.getPixel(body % width, body / width) ushr 24)
                assertTrue(bitmap.sameAs(result.overlay()))
            }
        }
        densePose.close()
    }

    @Test
    fun whatCannotBeDrawnOnIsASentence() {
        val pixels = ByteBuffer.allocateDirect(4 * 6 * 4)
        val frame = maquette.frame(PixelFormat.RGBA8, 6, 4, Plane(pixels))
        val other = failure(Status.INVALID_ARGUMENT) { frame.copyTo(buffer(4, 6)) }
        assertTrue(other, "4 x 6" in other && "6 x 4" in other)
        failure(Status.INVALID_ARGUMENT) { frame.copyTo(Bitmap.createBitmap(7, 4, Bitmap.Config.ARGB_8888)) }
        failure(Status.INVALID_ARGUMENT) { frame.copyTo(buffer(6, 4, usage = USAGE_CPU_READ_OFTEN)) }
        failure(Status.UNSUPPORTED) { frame.copyTo(buffer(6, 4, HardwareBuffer.RGB_888)) }
        val recycled = Bitmap.createBitmap(6, 4, Bitmap.Config.ARGB_8888).apply { recycle() }
        assertThrows(Exception::class.java) { frame.copyTo(recycled) }
        for (wrong in listOf(
            Bitmap.createBitmap(6, 4, Bitmap.Config.RGB_565),
            Bitmap.createBitmap(IntArray(24), 6, 4, Bitmap.Config.ARGB_8888),
        )) {
            assertThrows(IllegalArgumentException::class.java) { frame.copyTo(wrong) }
        }
        frame.close()
        assertClosed { frame.copyTo(buffer(6, 4)) }
    }
}
