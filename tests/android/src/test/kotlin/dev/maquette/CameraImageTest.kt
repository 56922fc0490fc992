package dev.maquette

import android.graphics.ImageFormat
import android.media.Image
import java.nio.ByteBuffer
import org.junit.Assert.assertArrayEquals
import org.junit.Assert.assertEquals
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

class CameraImageTest : AndroidTest() {
    private val maquette = Maquette()

    private class FakePlane(
        private val data: ByteBuffer,
        private val row: Int,
        private val pixel: Int,
    ) : Image.Plane() {
        override fun getBuffer() = data

        override fun getRowStride() = row

        override fun getPixelStride() = pixel
    }

    private class FakeImage(
        private val width: Int,
        private val height: Int,
        private val planes: List<Image.Plane>,
        private val format: Int = ImageFormat.YUV_420_888,
    ) : Image() {
        private var isOpen = true

        override fun getFormat() = format.also { check(isOpen) { "Image is already closed" } }

        override fun getWidth() = width

        override fun getHeight() = height

        override fun getTimestamp() = 77L

        override fun getTransform() = 0

        override fun getScalingMode() = 0

        override fun getPlanes() = planes.toTypedArray()

        override fun close() {
            isOpen = false
        }
    }

    private fun y(x: Int, y: Int) = 16 + (x * 3 + y * 7) % 220
    private fun u(x: Int, y: Int) = 30 + (x * 5 + y * 11) % 190
    private fun v(x: Int, y: Int) = 40 + (x * 13 + y * 2) % 180

    private fun Frame.rgb(): ByteArray {
        val pixels = ByteBuffer.allocateDirect(3 * widthPx * heightPx)
        copyPixels(PixelFormat.RGB8, pixels)
        return ByteArray(pixels.capacity()).also { pixels.get(it) }
    }

    /** Samples with a stride, in a buffer that ends with the last of them. */
    private fun plane(width: Int, height: Int, row: Int, pixel: Int, sample: (Int, Int) -> Int): FakePlane {
        val data = ByteBuffer.allocateDirect((height - 1) * row + (width - 1) * pixel + 1)
        for (y in 0 until height) for (x in 0 until width) data.put(y * row + x * pixel, sample(x, y).toByte())
        return FakePlane(data, row, pixel)
    }

    private fun image(width: Int, height: Int, row: Int, chromaRow: Int, chromaPixel: Int): FakeImage {
        val (w, h) = (width + 1) / 2 to (height + 1) / 2
        return FakeImage(
            width,
            height,
            listOf(
                plane(width, height, row, 1, ::y),
                plane(w, h, chromaRow, chromaPixel, ::u),
                plane(w, h, chromaRow, chromaPixel, ::v),
            ),
        )
    }

    private fun expected(width: Int, height: Int): ByteArray {
        val (w, h) = (width + 1) / 2 to (height + 1) / 2
        val luma = ByteBuffer.allocateDirect(width * height)
        for (row in 0 until height) for (x in 0 until width) luma.put(y(x, row).toByte())
        val chroma = ByteBuffer.allocateDirect(2 * w * h)
        for (row in 0 until h) for (x in 0 until w) chroma.put(u(x, row).toByte()).put(v(x, row).toByte())
        return maquette.frame(PixelFormat.NV12, width, height, Plane(luma), Plane(chroma)).use { it.rgb() }
    }

    @Test
    fun anyStridesGiveTheSamePixels() {
        for ((width, height) in listOf(64 to 48, 33 to 21, 1 to 1, 2 to 7)) {
            val pixels = expected(width, height)
            val half = (width + 1) / 2
            val images = listOf(
                image(width, height, width, half, 1), // planar
                image(width, height, width + 13, half + 5, 1), // with padding
                image(width, height, width + 64, 2 * half + 64, 2), // as phones' semi-planar
                image(width, height, width, 4 * half, 3),
            )
            for (image in images) {
                val frame = maquette.frame(image, isFullRange = false, sequence = 5)
                image.close()
                frame.use {
                    assertEquals(PixelFormat.NV12, it.format)
                    assertEquals(listOf(77L, 5L), listOf(it.timestampNs, it.sequence))
                    assertEquals(Clock.MONOTONIC, it.clock)
                    assertArrayEquals("$width x $height", pixels, it.rgb())
                }
            }
        }
    }

    @Test
    fun chromaOfOneBufferInEitherOrderIsTakenApart() {
        val (width, height) = 8 to 4
        val pixels = expected(width, height)
        for (isVFirst in listOf(false, true)) {
            val both = ByteBuffer.allocateDirect(width * height / 2)
            for (row in 0 until height / 2) for (x in 0 until width / 2) {
                val (a, b) = if (isVFirst) v(x, row) to u(x, row) else u(x, row) to v(x, row)
                both.put(a.toByte()).put(b.toByte())
            }
            both.rewind()
            val first = both.duplicate()
            val second = both.duplicate().position(1).slice()
            val (u, v) = if (isVFirst) second to first else first to second
            val image = FakeImage(
                width,
                height,
                listOf(plane(width, height, width, 1, ::y), FakePlane(u, width, 2), FakePlane(v, width, 2)),
            )
            maquette.frame(image, isFullRange = false).use { assertArrayEquals(pixels, it.rgb()) }
        }
    }

    @Test
    fun fullRangeIsBlackToWhite() {
        for ((level, isFullRange, expected) in listOf(
            Triple(0, true, 0),
            Triple(255, true, 255),
            Triple(128, true, 128),
            Triple(16, false, 0),
            Triple(235, false, 255),
        )) {
            val grey = { _: Int, _: Int -> 128 }
            val planes = listOf(plane(4, 4, 4, 1) { _, _ -> level }, plane(2, 2, 2, 1, grey), plane(2, 2, 2, 1, grey))
            maquette.frame(FakeImage(4, 4, planes), isFullRange).use { frame ->
                for (value in frame.rgb()) assertEquals("of $level", expected.toFloat(), value.toUByte().toFloat(), 1f)
            }
        }
    }

    @Test
    fun wrongImagesAreRefused() {
        val good = image(8, 4, 8, 4, 1).planes
        fun refused(status: Status, width: Int, height: Int, vararg planes: Image.Plane): String =
            failure(status) { maquette.frame(FakeImage(width, height, planes.toList())) }
        val short = refused(Status.INVALID_ARGUMENT, 8, 5, good[0], good[1], good[2])
        assertTrue(short, "40 bytes" in short && "32" in short)
        val heap = FakePlane(ByteBuffer.allocate(100), 8, 1)
        refused(Status.INVALID_ARGUMENT, 8, 4, good[0], heap, good[2])
        val large = ByteBuffer.allocateDirect(1000)
        refused(Status.INVALID_ARGUMENT, 8, 4, FakePlane(large, 7, 1), good[1], good[2])
        refused(Status.INVALID_ARGUMENT, 8, 4, FakePlane(large, -8, 1), good[1], good[2])
        refused(Status.INVALID_ARGUMENT, 8, 4, FakePlane(large, 8, 0), good[1], good[2])
        refused(Status.INVALID_ARGUMENT, 8, 4, FakePlane(large, Int.MAX_VALUE, Int.MAX_VALUE), good[1], good[2])
        refused(Status.IMAGE_SIZE, 0, 4, good[0], good[1], good[2])
        refused(Status.IMAGE_SIZE, Int.MAX_VALUE, Int.MAX_VALUE, good[0], good[1], good[2])
        assertThrows(IllegalArgumentException::class.java) {
            maquette.frame(FakeImage(8, 4, good.toList(), ImageFormat.JPEG))
        }
        val closed = image(8, 4, 8, 4, 1).apply { close() }
        assertClosed { maquette.frame(closed) }
    }

    @Test
    fun tenThousandImagesLeaveNothing() {
        val image = image(64, 48, 64, 64, 2)
        repeat(1000) { maquette.frame(image).close() }
        val before = residentMiB()
        repeat(9000) { maquette.frame(image).close() }
        assertTrue("${residentMiB() - before} MiB more", residentMiB() - before < 40)
    }
}
