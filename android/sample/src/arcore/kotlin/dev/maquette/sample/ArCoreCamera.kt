package dev.maquette.sample

import android.content.Context
import android.hardware.camera2.CameraCharacteristics
import android.hardware.camera2.CameraManager
import android.media.Image
import com.google.ar.core.CameraIntrinsics
import com.google.ar.core.Config
import com.google.ar.core.Frame
import com.google.ar.core.Session
import com.google.ar.core.TrackingFailureReason
import com.google.ar.core.TrackingState
import com.google.ar.core.exceptions.NotYetAvailableException
import dev.maquette.Intrinsics
import dev.maquette.Maquette
import java.nio.ByteBuffer
import java.nio.ByteOrder

/** Images, poses and points of ARCore: depths where the device has them, else the points that it follows. */
class ArCoreCamera(
    context: Context,
    private val maquette: Maquette,
    displayDegrees: Int,
) : PosedCamera {
    private val texture = OffscreenTexture()
    private val session = Session(context)
    private val hasDepth = session.isDepthModeSupported(Config.DepthMode.RAW_DEPTH_ONLY)
    private val degreesToUpright: Int
    private var latestNs = 0L

    override var problem: String? = null
        private set

    init {
        val config = Config(session)
        config.focusMode = Config.FocusMode.AUTO
        config.planeFindingMode = Config.PlaneFindingMode.DISABLED
        config.lightEstimationMode = Config.LightEstimationMode.DISABLED
        config.depthMode = if (hasDepth) Config.DepthMode.RAW_DEPTH_ONLY else Config.DepthMode.DISABLED
        session.configure(config)
        session.setCameraTextureName(texture.name)
        val cameras = context.getSystemService(CameraManager::class.java)
        val facts = cameras.getCameraCharacteristics(session.cameraConfig.cameraId)
        val sensorDegrees = facts.get(CameraCharacteristics.SENSOR_ORIENTATION) ?: 0
        degreesToUpright = (sensorDegrees - displayDegrees + 360) % 360
        session.resume()
    }

    override fun next(): TrackedImage? {
        val frame = session.update() // waits for the camera's next picture
        val camera = frame.camera
        if (camera.trackingState != TrackingState.TRACKING) {
            problem = adviceFor(camera.trackingFailureReason)
            return null
        }
        problem = null
        if (frame.timestamp == latestNs) return null
        latestNs = frame.timestamp
        val pose = FloatArray(16).also { camera.pose.toMatrix(it, 0) }
        // Depths are of the texture's view, which may be wider than that of the image in memory.
        val depths = if (hasDepth) depthsOf(frame, intrinsicsOf(camera.textureIntrinsics), pose) else null
        val points = depths ?: followedPointsOf(frame)
        val intrinsics = intrinsicsOf(camera.imageIntrinsics)
        return try {
            frame.acquireCameraImage().use { image ->
                TrackedImage(maquette.frame(image), intrinsics, pose, points, degreesToUpright)
            }
        } catch (_: NotYetAvailableException) {
            null
        }
    }

    override fun close() {
        session.pause()
        session.close()
        texture.close()
    }

    private fun intrinsicsOf(of: CameraIntrinsics): Intrinsics {
        val (width, height) = of.imageDimensions
        val (fx, fy) = of.focalLength
        val (cx, cy) = of.principalPoint
        // ARCore counts from the corner of the first pixel, Maquette from its centre.
        return Intrinsics(width, height, fx.toDouble(), fy.toDouble(), cx - 0.5, cy - 0.5)
    }

    private fun depthsOf(frame: Frame, intrinsics: Intrinsics, pose: FloatArray): FloatArray? =
        try {
            frame.acquireRawDepthImage16Bits().use { depth ->
                frame.acquireRawDepthConfidenceImage().use { confidence ->
                    val (width, height) = depth.width to depth.height
                    val bytes = rowsOf(depth, 2)
                    val mm = ShortArray(width * height)
                    ByteBuffer.wrap(bytes).order(ByteOrder.LITTLE_ENDIAN).asShortBuffer().get(mm)
                    pointsOfDepth(width, height, mm, rowsOf(confidence, 1), intrinsics, pose, DEPTH_STEP)
                }
            }
        } catch (_: NotYetAvailableException) {
            null
        }

    private fun followedPointsOf(frame: Frame): FloatArray =
        frame.acquirePointCloud().use { cloud -> FloatArray(cloud.points.remaining()).also { cloud.points.get(it) } }

    /** Without padding. */
    private fun rowsOf(image: Image, pixelBytes: Int): ByteArray {
        val plane = image.planes[0]
        val rows = ByteArray(image.width * image.height * pixelBytes)
        for (y in 0 until image.height) {
            plane.buffer.position(y * plane.rowStride)
            plane.buffer.get(rows, y * image.width * pixelBytes, image.width * pixelBytes)
        }
        return rows
    }

    private fun adviceFor(reason: TrackingFailureReason): String =
        when (reason) {
            TrackingFailureReason.INSUFFICIENT_LIGHT -> "It is too dark."
            TrackingFailureReason.EXCESSIVE_MOTION -> "Move more slowly."
            TrackingFailureReason.INSUFFICIENT_FEATURES -> "Look at things with edges and patterns."
            TrackingFailureReason.CAMERA_UNAVAILABLE -> "Another app uses the camera."
            else -> "Move the device slowly, so that it finds out where it is."
        }

    private companion object {
        const val DEPTH_STEP = 2
    }
}
