package dev.maquette.sample

import dev.maquette.Frame
import dev.maquette.Maquette
import dev.maquette.ModelBundle
import dev.maquette.PinholeCamera
import dev.maquette.PixelFormat
import dev.maquette.PointCloud
import dev.maquette.Scene
import dev.maquette.SceneBuildConfig
import dev.maquette.Progress
import java.nio.ByteBuffer
import kotlin.math.abs
import kotlin.math.acos
import kotlin.math.floor
import kotlin.math.sqrt

/**
 * A place, from the images of a camera that moves through it: keeps those that show it sharply from somewhere new,
 * and all points that are sure enough, thinned out to one a cell. For one thread.
 *
 * @param maxPhotos each is kept in memory: 0.5 MB at 640 x 480.
 */
class PlaceCapture(private val maxPhotos: Int = 60) : AutoCloseable {
    /** The decision about an image. */
    enum class Verdict {
        KEPT,

        /** Another one shows nearly the same. */
        NOT_NEW,
        BLURRED,

        /** There are as many as memory is meant for. */
        FULL,
    }

    private class Photo(val frame: Frame, val camera: PinholeCamera)

    private val photos = mutableListOf<Photo>()
    private var recentSharpness = 0.0

    /** Where in [sums] a cell's points are: x, y, z, each times its confidence, and the sum of these. */
    private val cells = HashMap<Long, Int>()
    private var sums = FloatArray(4096)

    val photoCount get() = photos.size
    val pointCount get() = cells.size

    /** Takes the image over: it is kept or closed. */
    fun offer(image: TrackedImage): Verdict {
        addPoints(image.points)
        val camera = image.camera
        val verdict =
            when {
                photos.size >= maxPhotos -> Verdict.FULL
                photos.any { isNear(it.camera, camera) } -> Verdict.NOT_NEW
                !isSharp(image.frame) -> Verdict.BLURRED
                else -> Verdict.KEPT
            }
        if (verdict == Verdict.KEPT) photos.add(Photo(image.frame, camera)) else image.close()
        return verdict
    }

    /**
     * Builds a scene of what was kept; more can be offered afterwards. Takes seconds to minutes.
     *
     * @param longSidePx of the photos, as in [SceneBuildConfig].
     * @throws IllegalStateException for too few photos or points; it says what to do.
     */
    fun build(
        maquette: Maquette,
        networks: ModelBundle,
        longSidePx: Int = 640,
        progress: Progress = Progress { _, _ -> true },
    ): Scene {
        check(photoCount >= MIN_PHOTOS) { "There are $photoCount photos; walk around until there are $MIN_PHOTOS." }
        check(pointCount >= MIN_POINTS) { "Too little was measured. Look at things with edges and patterns." }
        // As many places where visibility is tested as a photo has points: a sparse cloud would let through what is
        // behind it. Of a place that is walked around in, a photo shows about a third.
        val intrinsics = photos[0].camera.intrinsics
        val pixels = longSidePx.toDouble() * longSidePx * intrinsics.heightPx / intrinsics.widthPx
        val scale = sqrt(pointCount / 3 / pixels).coerceIn(1.0 / 16, 1.0)
        val config = SceneBuildConfig(longSidePx = longSidePx, visibilityScale = scale)
        return maquette.sceneBuilder(cloud(), networks, config).use { builder ->
            photos.forEachIndexed { index, photo ->
                builder.addView(photo.frame, photo.camera) { done, _ ->
                    progress.onProgress((index + done) / photoCount, "Photo ${index + 1} of $photoCount")
                }
            }
            builder.finish()
        }
    }

    override fun close() {
        photos.forEach { it.frame.close() }
        photos.clear()
        cells.clear()
    }

    private fun isNear(a: PinholeCamera, b: PinholeCamera): Boolean {
        val away = (Vector.of(a.centre) - Vector.of(b.centre)).length
        val turn = Vector.of(a.rotation.takeLast(3)) dot Vector.of(b.rotation.takeLast(3))
        return away < MIN_MOVE_M && acos(turn.coerceIn(-1.0, 1.0)) < MIN_TURN_RAD
    }

    /** Compared with the sharpest of late: walls are smoother than shelves, so that the comparison fades. */
    private fun isSharp(frame: Frame): Boolean {
        val sharpness = sharpnessOf(frame)
        val isSharp = sharpness >= MIN_SHARPNESS * recentSharpness
        recentSharpness = maxOf(sharpness, FADING * recentSharpness)
        return isSharp
    }

    /** The mean of the Laplacian's absolute values, which motion blur lowers. */
    private fun sharpnessOf(frame: Frame): Double {
        val (width, height) = frame.widthPx to frame.heightPx
        val buffer = ByteBuffer.allocateDirect(width * height)
        frame.copyPixels(PixelFormat.GREY8, buffer)
        val grey = ByteArray(width * height).also { buffer.get(it) }
        val at = { index: Int -> grey[index].toInt() and 0xFF }
        var sum = 0L
        var count = 0
        for (y in 1 until height - 1 step 2) for (x in 1 until width - 1 step 2) {
            val i = y * width + x
            sum += abs(4 * at(i) - at(i - 1) - at(i + 1) - at(i - width) - at(i + width))
            count++
        }
        return sum.toDouble() / maxOf(count, 1)
    }

    private fun addPoints(points: FloatArray) {
        for (i in points.indices step 4) {
            val weight = points[i + 3]
            if (!(weight >= MIN_CONFIDENCE)) continue
            val cell = cellOf(points, i) ?: continue
            var place = cells[cell]
            if (place == null) {
                if (cells.size >= MAX_POINTS) continue
                place = cells.size
                cells[cell] = place
                if (sums.size < 4 * cells.size) sums = sums.copyOf(2 * sums.size)
            }
            for (axis in 0..2) sums[4 * place + axis] += weight * points[i + axis]
            sums[4 * place + 3] += weight
        }
    }

    /** null for what is out of reach or no number. */
    private fun cellOf(points: FloatArray, first: Int): Long? {
        var cell = 0L
        for (axis in 0..2) {
            val at = floor(points[first + axis] / CELL_M)
            if (!(abs(at) < CELL_LIMIT)) return null
            cell = cell * 2 * CELL_LIMIT + (at.toLong() + CELL_LIMIT)
        }
        return cell
    }

    private fun cloud(): PointCloud {
        val xyz = FloatArray(3 * cells.size) { sums[4 * (it / 3) + it % 3] / sums[4 * (it / 3) + 3] }
        return PointCloud.of(xyz, up = listOf(0.0, 1.0, 0.0))
    }

    companion object {
        const val MIN_PHOTOS = 5
        private const val MIN_POINTS = 100
        private const val MAX_POINTS = 400_000
        private const val MIN_MOVE_M = 0.1
        private const val MIN_TURN_RAD = 0.17
        private const val MIN_SHARPNESS = 0.6
        private const val FADING = 0.95

        /** Below, ARCore's points and depths are mostly wrong. */
        private const val MIN_CONFIDENCE = 0.3f
        private const val CELL_M = 0.01f
        private const val CELL_LIMIT = 1L shl 20
    }
}
