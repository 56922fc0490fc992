package dev.maquette

import java.io.File
import java.nio.ByteBuffer
import kotlin.concurrent.thread
import kotlin.math.abs
import kotlin.math.cos
import kotlin.math.sin
import kotlin.math.sqrt
import org.junit.Assert.assertEquals
import org.junit.Assert.assertNotNull
import org.junit.Assert.assertNull
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

class SceneTest : AndroidTest() {
    private val maquette = Maquette()
    private val bundle = ModelBundle.ofFolder(TestFiles.scenesBundle.path)
    private val quick = SceneBuildConfig(longSidePx = 160, maxViews = 4, maxPoints = 40_000)

    /** Even on a ball of radius 1 about the origin. */
    private fun ball(points: Int): PointCloud {
        val xyz = FloatArray(3 * points)
        for (i in 0 until points) {
            val z = 1 - 2 * (i + 0.5) / points
            val radius = sqrt(1 - z * z)
            xyz[3 * i] = (radius * cos(2.399963 * i)).toFloat()
            xyz[3 * i + 1] = (radius * sin(2.399963 * i)).toFloat()
            xyz[3 * i + 2] = z.toFloat()
        }
        return PointCloud.of(xyz, up = listOf(0.0, 0.0, 1.0))
    }

    /** At (3, 0, 0), turned about the world's z; looks at the origin. */
    private fun cameraAt(angle: Double, widthPx: Int = 64, heightPx: Int = 48): PinholeCamera {
        val c = cos(angle)
        val s = sin(angle)
        val f = widthPx.toDouble()
        val intrinsics = Intrinsics(widthPx, heightPx, f, f, 0.5 * (widthPx - 1), 0.5 * (heightPx - 1))
        return PinholeCamera(intrinsics, listOf(-s, c, 0.0, 0.0, 0.0, -1.0, -c, -s, 0.0), listOf(3 * c, 3 * s, 0.0))
    }

    /** A photo of one colour, blue 40, green 90, red 200. */
    private fun photo(widthPx: Int = 64, heightPx: Int = 48): Frame {
        val pixels = ByteBuffer.allocateDirect(3 * widthPx * heightPx)
        repeat(widthPx * heightPx) { pixels.put(40).put(90).put(200.toByte()) }
        return maquette.frame(PixelFormat.BGR8, widthPx, heightPx, Plane(pixels))
    }

    private fun ballScene(points: Int = 500): Scene =
        maquette.sceneBuilder(ball(points), bundle).use { builder ->
            photo().use { photo -> listOf(0.0, 1.5, 3.0, 4.5).forEach { builder.addView(photo, cameraAt(it)) } }
            builder.finish()
        }

    private fun smaller(camera: PinholeCamera, by: Int): PinholeCamera =
        with(camera.intrinsics) {
            val scaled = { c: Double -> (c + 0.5) / by - 0.5 }
            camera.copy(
                intrinsics = Intrinsics(widthPx / by, heightPx / by, fxPx / by, fyPx / by, scaled(cxPx), scaled(cyPx)),
            )
        }

    @Test
    fun aCaptureBecomesASceneThatLooksLikeItsPhotos() {
        maquette.openCapture(TestFiles.room.path).use { capture ->
            assertEquals(30, capture.views.size)
            assertEquals(5, capture.views.count { it.isHeldOut })
            assertEquals(listOf(0.0, 0.0, 1.0), capture.up)
            assertEquals(317_760L, capture.pointCount)
            assertEquals(emptyList<Capture.Drop>(), capture.drops)
            val done = mutableListOf<Double>()
            val stages = mutableListOf<String>()
            val scene = maquette.buildScene(capture, bundle, quick) { fraction, stage ->
                done += fraction
                stages.add(stage)
            }
            assertEquals(done.sorted(), done)
            assertEquals(1.0, done.last(), 0.0)
            assertTrue(stages.first(), stages.first().startsWith("Photo 1 of 4"))
            val stats = scene.buildStats!!
            assertEquals(listOf<Any>(4, 0), listOf(stats.views, stats.unusedViews))
            assertTrue(stats.cloudPoints in 1..40_000 && stats.extractMs > 0)
            assertEquals(stats.seenPoints, scene.info.pointCount)
            assertEquals(64, scene.info.networksSha256.length)

            maquette.sceneRenderer(scene, bundle).use { renderer ->
                scene.close()
                renderer.run(smaller(capture.views[0].camera, by = 4)).use { image ->
                    assertEquals(160 to 120, image.widthPx to image.heightPx)
                    assertTrue(image.sceneStats.totalMs > 0 && image.sceneStats.shadedPoints > 1000)
                    val alpha = image.plane(RenderedImage.Plane.ALPHA)
                    assertEquals(160 * 120, alpha.capacity())
                    assertTrue(alpha.isReadOnly)
                    val depth = image.plane(RenderedImage.Plane.DEPTH).asFloatBuffer()
                    assertTrue((0 until depth.capacity()).count { depth[it] > 0 } > 160 * 120 / 2)

                    val picture = image.toBitmap()
                    val expected = capture.loadView(0).use { it.resize(160, 120).use(Frame::bgr) }
                    val bgr = image.plane(RenderedImage.Plane.BGR)
                    var difference = 0
                    for (k in 0 until 160 * 120) {
                        val pixel = picture.getPixel(k % 160, k / 160)
                        val channels = listOf(pixel and 0xFF, pixel shr 8 and 0xFF, pixel shr 16 and 0xFF)
                        assertEquals(List(3) { bgr[3 * k + it].toInt() and 0xFF }, channels)
                        for (i in 0..2) difference += abs(channels[i] - (expected[3 * k + i].toInt() and 0xFF))
                    }
                    val mean = difference / (3.0 * 160 * 120)
                    assertTrue("$mean levels from the photo", mean < 25)
                }
            }
        }
    }

    @Test
    fun aSceneIsSavedAndOpenedFromAFileAndFromMemory() = TestFiles.inNewFolder<Unit> { folder ->
        ballScene().use { scene ->
            val file = File(folder, "pläce.maqs")
            scene.save(file.path)
            scene.savePly(File(folder, "place.ply").path)
            assertTrue(File(folder, "place.ply").readText().startsWith("ply"))
            failure(Status.UNWRITABLE) { scene.save(File(folder, "no/place.maqs").path) }
            val bytes = file.readBytes()
            val pictures = listOf(
                scene, maquette.openScene(file.path), maquette.openScene(TestFiles.direct(bytes)),
            ).map { opened ->
                assertEquals(scene.info, opened.info)
                if (opened !== scene) assertNull(opened.buildStats)
                maquette.sceneRenderer(opened, bundle).use { renderer ->
                    renderer.run(cameraAt(0.3)).use { image ->
                        image.save(File(folder, "view.png").path, withAlpha = true)
                        failure(Status.INVALID_ARGUMENT) { image.save(File(folder, "view.gif").path) }
                        val bgr = ByteArray(3 * 64 * 48)
                        image.plane(RenderedImage.Plane.BGR).get(bgr)
                        bgr.toList()
                    }
                }
            }
            assertEquals(pictures[0], pictures[1])
            assertEquals(pictures[0], pictures[2])

            failure(Status.NOT_FOUND) { maquette.openScene(File(folder, "other.maqs").path) }
            failure(Status.UNREADABLE) { maquette.openScene(TestFiles.photo.path) }
            failure(Status.UNREADABLE) { maquette.openScene(TestFiles.direct(bytes.copyOf(bytes.size / 2))) }
            for (at in bytes.indices step bytes.size / 50) {
                val damaged = bytes.clone().also { it[at] = (it[at] + 1).toByte() }
                val error = assertThrows(MaquetteException::class.java) {
                    maquette.openScene(TestFiles.direct(damaged))
                }
                assertTrue(error.message, error.status in listOf(Status.UNREADABLE, Status.UNSUPPORTED))
            }
            failure(Status.UNREADABLE) { maquette.openScene(ByteBuffer.allocateDirect(1)) }
            failure(Status.INVALID_ARGUMENT) { maquette.openScene(ByteBuffer.wrap(bytes)) }
        }
    }

    @Test
    fun buildingIsCancelled() {
        maquette.openCapture(TestFiles.room.path).use { capture ->
            var calls = 0
            failure(Status.CANCELLED) { maquette.buildScene(capture, bundle, quick) { _, _ -> ++calls < 3 } }
            assertEquals(3, calls)
            assertThrows(ArithmeticException::class.java) {
                maquette.buildScene(capture, bundle, quick) { _, _ -> throw ArithmeticException() }
            }
        }
        maquette.sceneBuilder(ball(500), bundle).use { builder ->
            photo().use { photo ->
                builder.cancel()
                failure(Status.CANCELLED) { builder.addView(photo, cameraAt(0.0)) }
                failure(Status.CANCELLED) { builder.addView(photo, cameraAt(0.0)) { _, _ -> false } }
                assertThrows(ArithmeticException::class.java) {
                    builder.addView(photo, cameraAt(0.0)) { _, _ -> throw ArithmeticException() }
                }
                assertEquals(0, builder.stats.views)
                val cancelling = thread { repeat(200) { builder.cancel(); Thread.sleep(1) } }
                val outcomes = List(20) {
                    runCatching { builder.addView(photo, cameraAt(0.0)) }.exceptionOrNull() as MaquetteException?
                }
                cancelling.join()
                assertTrue(outcomes.all { it == null || it.status == Status.CANCELLED })
            }
        }
    }

    @Test
    fun anAppsOwnCloudAndPhotosBecomeAScene() {
        maquette.sceneBuilder(ball(2000), bundle).use { builder ->
            failure(Status.INVALID_ARGUMENT) { builder.finish() }
            var told = 0
            val seen = photo().use { builder.addView(it, cameraAt(0.0)) { _, _ -> ++told > 0 } }
            assertTrue("$seen points, told $told times", seen in 200..1800 && told > 0)
            assertEquals(1 to seen, builder.stats.views to builder.stats.seenPoints)
            val first = builder.finish()
            photo().use { builder.addView(it, cameraAt(3.0)) }
            val second = builder.finish()
            assertEquals(seen, first.info.pointCount)
            assertTrue(second.info.pointCount > seen)
            assertEquals(second.info.pointCount, second.buildStats!!.seenPoints)

            photo(32, 32).use { other ->
                failure(Status.INVALID_ARGUMENT) { builder.addView(other, cameraAt(0.0)) }
            }
            photo().use { photo ->
                val mirrored = cameraAt(0.0).copy(rotation = List(9) { 1.0 })
                failure(Status.INVALID_ARGUMENT) { builder.addView(photo, mirrored) }
            }
            maquette.sceneRenderer(first, bundle).use { renderer ->
                failure(Status.IMAGE_SIZE) { renderer.run(cameraAt(0.0, widthPx = -1)) }
                failure(Status.IMAGE_SIZE) { renderer.run(cameraAt(0.0, widthPx = Int.MAX_VALUE)) }
                val camera = cameraAt(0.0)
                val bent = camera.copy(intrinsics = camera.intrinsics.copy(distortion = List(8) { 0.1 }))
                failure(Status.INVALID_ARGUMENT) { renderer.run(bent) }
            }
            assertEquals(2, builder.stats.views)
        }
    }

    @Test
    fun wrongInputIsAnExceptionThatSaysWhatToDo() {
        val missing = failure(Status.NOT_FOUND) { maquette.openCapture("/no/pläce") }
        assertTrue(missing, "pläce" in missing)
        failure(Status.NOT_FOUND) { maquette.openCapture(TestFiles.bundle.path) }
        val up = listOf(0.0, 0.0, 1.0)
        val short = failure(Status.INVALID_ARGUMENT) {
            maquette.sceneBuilder(PointCloud(ByteBuffer.allocateDirect(35), 3, up = up), bundle)
        }
        assertTrue(short, "3 points" in short && "35 bytes" in short)
        for (cloud in listOf(
            PointCloud(ByteBuffer.allocate(36), 3, up = up),
            PointCloud(ByteBuffer.allocateDirect(36), -1, up = up),
            PointCloud(ByteBuffer.allocateDirect(36), Long.MAX_VALUE, up = up),
            PointCloud(ByteBuffer.allocateDirect(36), 0, up = up),
            PointCloud.of(floatArrayOf(0f, Float.NaN, 0f), up = up),
            PointCloud.of(FloatArray(3), up = listOf(0.0, 0.0, 0.0)),
        )) {
            failure(Status.INVALID_ARGUMENT) { maquette.sceneBuilder(cloud, bundle) }
        }
        assertThrows(IllegalArgumentException::class.java) { PointCloud.of(FloatArray(4), up = up) }
        assertThrows(IllegalArgumentException::class.java) { PointCloud.of(FloatArray(3), up = listOf(1.0)) }
        assertThrows(IllegalArgumentException::class.java) { cameraAt(0.0).copy(centre = listOf(1.0)) }
        for (config in listOf(
            SceneBuildConfig(coefficientBits = 7),
            SceneBuildConfig(maxPoints = -1),
            SceneBuildConfig(visibilityScale = Double.NaN),
            SceneBuildConfig(longSidePx = -2),
        )) {
            failure(Status.INVALID_ARGUMENT) { maquette.sceneBuilder(ball(10), bundle, config) }
        }
        val densePose = ModelBundle.ofFolder(TestFiles.bundle.path)
        failure(Status.UNSUPPORTED) { maquette.sceneBuilder(ball(10), densePose) }
        ballScene().use { scene ->
            val damaged = TestFiles.bundleInMemory(TestFiles.scenesBundle).toMutableMap()
            damaged["basis.bin"] = TestFiles.direct(ByteArray(9))
            failure(Status.BAD_BUNDLE) { maquette.sceneRenderer(scene, ModelBundle.ofBuffers(damaged)) }
            val config = SceneRenderer.Config(imagePoolSize = 65)
            failure(Status.INVALID_ARGUMENT) { maquette.sceneRenderer(scene, bundle, config) }
        }
    }

    @Test
    fun objectsAreClosedInAnyOrderAndNotUsedAfterwards() {
        val ofThem = Maquette()
        val capture = ofThem.openCapture(TestFiles.room.path)
        val builder = ofThem.sceneBuilder(ball(500), bundle)
        photo().use { builder.addView(it, cameraAt(0.0)) }
        val scene = builder.finish()
        val config = SceneRenderer.Config(imagePoolSize = 1, background = 0x102030)
        val renderer = ofThem.sceneRenderer(scene, bundle, config)
        ofThem.close()
        assertClosed { ofThem.openCapture(TestFiles.room.path) }
        val view = capture.loadView(3)
        failure(Status.INVALID_ARGUMENT) { capture.loadView(30) }
        capture.close()
        assertClosed { capture.loadView(3) }
        builder.close()
        assertClosed { builder.stats }
        assertClosed { builder.cancel() }
        scene.close()
        assertClosed { scene.save("/tmp/never.maqs") }
        val image = renderer.run(cameraAt(0.0).copy(centre = listOf(30.0, 0.0, 0.0)))
        failure(Status.POOL_EMPTY) { renderer.run(cameraAt(0.0)) }
        renderer.close()
        assertClosed { renderer.run(cameraAt(0.0)) }
        assertEquals(0, image.plane(RenderedImage.Plane.ALPHA)[0].toInt())
        assertEquals("the background", 0x102030, image.toBitmap().getPixel(0, 0) and 0xFFFFFF)
        image.close()
        image.close()
        assertClosed { image.plane(RenderedImage.Plane.BGR) }
        assertClosed { image.toBitmap() }
        assertEquals(640, view.widthPx)
        view.close()
        assertNotNull(scene.info)
        val others = Maquette()
        val closed = ballScene().apply { close() }
        assertClosed { others.sceneRenderer(closed, bundle) }
        others.close()
    }

    @Test
    fun tenThousandScenesLeaveNothing() = TestFiles.inNewFolder<Unit> { folder ->
        val file = File(folder, "ball.maqs")
        ballScene(points = 100).use { it.save(file.path) }
        val bytes = TestFiles.direct(file.readBytes())
        fun open(count: Int) = repeat(count) { maquette.openScene(bytes).close() }
        open(1000)
        val before = residentMiB()
        open(9000)
        assertTrue("${residentMiB() - before} MiB more", residentMiB() - before < 40)
    }

    @Test
    fun garbageIsCollectedWhileItRenders() {
        maquette.sceneRenderer(ballScene(), bundle, SceneRenderer.Config(imagePoolSize = 3)).use { renderer ->
            var images = 0
            whileGarbageIsCollected("30 images") {
                try {
                    // Every other image is forgotten.
                    val image = renderer.run(cameraAt(0.1 * images))
                    assertEquals(64 * 48, image.plane(RenderedImage.Plane.ALPHA).capacity())
                    if (++images % 2 == 0) image.close()
                } catch (error: MaquetteException) {
                    assertEquals(error.message, Status.POOL_EMPTY, error.status)
                }
                images >= 30
            }
        }
    }
}

/** The pixels as BGR8. */
private fun Frame.bgr(): ByteArray {
    val pixels = ByteBuffer.allocateDirect(3 * widthPx * heightPx)
    copyPixels(PixelFormat.BGR8, pixels)
    return ByteArray(pixels.capacity()).also { pixels.get(it) }
}
