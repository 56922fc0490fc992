package dev.maquette

import dev.maquette.jni.Native
import dev.maquette.jni.maq_camera_health_result
import java.nio.ByteBuffer
import org.junit.Assert.assertEquals
import org.junit.Assert.assertTrue
import org.junit.Test

class CameraHealthTest : AndroidTest() {
    private val maquette = Maquette()

    private fun CameraHealth.pushTexture(number: Int, greys: ByteArray = MovingTexture.greys(number)) =
        MovingTexture.frame(maquette, number, greys).use(::push)

    @Test
    fun aFrozenABlackAndAnotherPictureAreEvents() =
        maquette.cameraHealth().use { health ->
            assertTrue(health.pushTexture(0).isStreamStart)
            val moving = (1..9).map { health.pushTexture(it) }
            assertTrue(moving.all { it.event == CameraHealth.Event.OK && it.state == CameraHealth.Event.OK })
            assertEquals(moving[0].columns * moving[0].rows, moving[0].map.size)
            val frozen = (10..12).map { health.pushTexture(it, MovingTexture.greys(9)) }
            assertEquals(CameraHealth.Event.FREEZE, frozen.first { it.event != CameraHealth.Event.OK }.event)
            assertEquals(CameraHealth.Event.FREEZE, frozen.last().state)
            val black = health.pushTexture(13, ByteArray(160 * 120))
            assertEquals(CameraHealth.Event.BLACK to 1_300_000_000L, black.event to black.beganNs)
            assertEquals("freeze", CameraHealth.Event.FREEZE.word)
            val stats = health.stats
            assertEquals(listOf(14L, 2L, 1L), listOf(stats.pushedCount, stats.eventCount, stats.streamStartCount))
        }

    @Test
    fun aStreamBeginsAnewOnRequestAndWhereTimeGoesBack() =
        maquette.cameraHealth().use { health ->
            assertEquals(listOf(true, false), (0..1).map { health.pushTexture(it).isStreamStart })
            health.reset()
            assertTrue(health.pushTexture(2).isStreamStart)
            assertTrue("an earlier time", health.pushTexture(1).isStreamStart)
            assertTrue("a pause", health.pushTexture(20).isStreamStart)
            assertEquals(4L, health.stats.streamStartCount)
        }

    @Test
    fun framesOfAnySizeAreTakenAndDepthIsRefused() =
        maquette.cameraHealth().use<CameraHealth, Unit> { health ->
            val flat = ByteBuffer.allocateDirect(3000)
            for ((width, height) in listOf(1 to 1, 3000 to 1, 1 to 3000)) {
                maquette.frame(PixelFormat.GREY8, width, height, Plane(flat)).use { frame ->
                    assertEquals(0, health.push(frame).map.size)
                }
            }
            val depth = ByteBuffer.allocateDirect(2 * 160 * 120)
            maquette.frame(PixelFormat.DEPTH16, 160, 120, Plane(depth)).use {
                failure(Status.UNSUPPORTED) { health.push(it) }
            }
            assertEquals("as it was before", 3L, health.stats.pushedCount)
            failure(Status.INVALID_ARGUMENT) { Native.maq_camera_health_push(0, 0, maq_camera_health_result()) }
            failure(Status.INVALID_ARGUMENT) { Native.maq_camera_health_create(0) }
        }

    @Test
    fun itIsClosedInAnyOrderAndNotUsedAfterwards() {
        val ofIts = Maquette()
        val health = ofIts.cameraHealth()
        ofIts.close()
        assertClosed { ofIts.cameraHealth() }
        assertTrue(health.pushTexture(0).isStreamStart)
        health.close()
        health.close()
        assertClosed { health.pushTexture(1) }
        assertClosed { health.reset() }
        assertClosed { health.stats }
    }
}
