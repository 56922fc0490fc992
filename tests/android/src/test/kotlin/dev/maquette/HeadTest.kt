package dev.maquette

import java.io.File
import java.nio.ByteBuffer
import java.nio.ByteOrder
import java.nio.FloatBuffer
import kotlin.concurrent.thread
import kotlin.math.abs
import kotlin.math.sqrt
import org.junit.Assert.assertEquals
import org.junit.Assert.assertFalse
import org.junit.Assert.assertNull
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

/** Most of it with small networks that see a round head in what is not black, and another one in blue. */
class HeadTest : AndroidTest() {
    private val maquette = Maquette()
    private val bundle = ModelBundle.ofFolder(TestFiles.roundHeadsBundle.path)
    private val box = HeadBox(110f, 60f, 200f, 180f)
    private val coarse = HeadMesh.Config(cellM = 0.008)

    private fun photo(blue: Int = 120, green: Int = 130, red: Int = 140): Frame {
        val pixels = ByteBuffer.allocateDirect(3 * 320 * 240)
        repeat(320 * 240) { pixels.put(blue.toByte()).put(green.toByte()).put(red.toByte()) }
        return maquette.frame(PixelFormat.BGR8, 320, 240, Plane(pixels))
    }

    private val plain = HeadBuilder.Config(texture = HeadBuilder.Texture.OFF)

    private fun <T> withBuilder(config: HeadBuilder.Config = plain, work: (HeadBuilder) -> T): T =
        maquette.headBuilder(bundle, config).use { builder ->
            photo().use { builder.addPhoto(it, box) }
            work(builder)
        }

    private fun head(config: HeadBuilder.Config = plain): Head = withBuilder(config) { it.fit(0.0) }

    private fun FloatBuffer.points() =
        List(capacity() / 3) { k ->
            val (x, y, z) = List(3) { get(3 * k + it).toDouble() }
            Point3(x, y, z)
        }

    /** As far as the numbers of a file are rounded. */
    private fun assertNear(expected: Point3, actual: Point3) =
        assertEquals(0.0, length(Point3(expected.x - actual.x, expected.y - actual.y, expected.z - actual.z)), 2e-4)

    private fun assertNear(expected: FloatBuffer, actual: FloatBuffer) {
        assertEquals(expected.capacity(), actual.capacity())
        for ((p, q) in expected.points() zip actual.points()) assertNear(p, q)
    }

    /** The area that both boxes cover, of the area that either covers. */
    private fun overlap(a: HeadBox, b: HeadBox): Float {
        fun area(box: HeadBox) = (box.right - box.left).coerceAtLeast(0f) * (box.bottom - box.top).coerceAtLeast(0f)
        val both =
            area(HeadBox(maxOf(a.left, b.left), maxOf(a.top, b.top), minOf(a.right, b.right), minOf(a.bottom, b.bottom)))
        return both / (area(a) + area(b) - both)
    }

    private fun length(p: Point3) = sqrt(p.x * p.x + p.y * p.y + p.z * p.z)

    @Test
    fun photosAreAddedToAHead() =
        maquette.headBuilder(bundle).use { builder ->
            head().use { builder.addHead(it) }
            photo().use { builder.addPhoto(it, box) }
            builder.fit(0.0).use { assertEquals(2, it.info.photos) }
            assertEquals(1, builder.photos.size)
        }

    @Test
    fun aPhotoBecomesAHeadWithAMeshAndLandmarks() =
        withBuilder<Unit> { builder ->
            val done = mutableListOf<Double>()
            val head = builder.fit(0.0) { fraction, stage -> done.add(fraction) && stage.isNotEmpty() }
            assertEquals(listOf(0.0, 1.0), listOf(done.first(), done.last()))
            assertEquals(done.sorted(), done)
            assertEquals(1, head.info.photos)
            assertEquals(Head.Scale.PRIOR, head.info.scale)
            assertTrue("${head.info.scaleSigma}", head.info.scaleSigma in 0.02..0.06)
            assertEquals(0, head.info.texturePx)
            assertEquals(listOf("nose_tip", "chin", "crown", "pupil_left", "pupil_right"), head.landmarks.keys.toList())
            val left = head.landmarks["pupil_left"]!!
            assertTrue("left is the person's", left.point.x > 0.02 && left.sigmaM > 0)
            assertEquals(-left.point.x, head.landmarks["pupil_right"]!!.point.x, 1e-3)
            val camera = head.cameras.single()
            val found = builder.photos.single()
            assertEquals(320 to 240, camera.intrinsics.widthPx to camera.intrinsics.heightPx)
            assertEquals(found.focalPx.toDouble(), camera.intrinsics.fxPx, 0.01)
            assertEquals(box, found.box)
            assertTrue(found.isUsed && found.headCoverage in 0.1f..0.4f && found.rmsPx in 0f..2f)
            val stats = builder.stats
            assertEquals(listOf(1, 1, 0), listOf(stats.photos, stats.usedPhotos, stats.steps))
            assertTrue(stats.encodeMs > 0 && stats.poseMs > 0 && stats.totalMs >= stats.poseMs && stats.threads > 0)
            assertEquals(DensePose.Provider.CPU, stats.provider)

            val mesh = head.mesh(coarse)
            head.close()
            assertTrue("${mesh.vertexCount}", mesh.vertexCount > 300)
            assertEquals("closed", 2 * (mesh.vertexCount - 2), mesh.triangleCount)
            val crown = head.landmarks["crown"]!!.point.y
            val template = mesh.templatePoints.points()
            for ((k, p) in mesh.positions.points().withIndex()) {
                assertTrue("$p", length(p) < 0.3)
                assertEquals("the crown of the template is at 121 mm", p.y * 0.121, template[k].y * crown, 1e-3)
            }
            for (n in mesh.normals.points()) assertEquals(1.0, length(n), 1e-4)
            val triangles = IntArray(3 * mesh.triangleCount).also { mesh.triangles.get(it) }
            assertEquals((0 until mesh.vertexCount).toSet(), triangles.toSet())
            assertEquals(3 * mesh.vertexCount, mesh.colours.remaining())
            for (buffer in listOf(mesh.positions, mesh.normals, mesh.templatePoints, mesh.triangles, mesh.colours)) {
                assertTrue(buffer.isDirect && buffer.isReadOnly && buffer.position() == 0)
            }
            assertNull(mesh.textureCoordinates)
            assertNull(mesh.textureJpeg)
            assertTrue(mesh.morphTargets.isEmpty())
            assertEquals(0f, mesh.simplificationErrorM)
        }

    @Test
    fun meshesAreAsFineAsIsAskedFor() {
        head().use { head ->
            val full = head.mesh(HeadMesh.Config(HeadMesh.Config.ALL_TRIANGLES, cellM = 0.005))
            val fewer = head.mesh(HeadMesh.Config(500, cellM = 0.005))
            assertTrue("${full.triangleCount}", full.triangleCount > 2000)
            assertTrue("${fewer.triangleCount}", fewer.triangleCount in 400..500)
            assertTrue("${fewer.simplificationErrorM}", fewer.simplificationErrorM in 1e-6f..0.01f)
            assertThrows(IllegalArgumentException::class.java) { HeadMesh.Config(-2) }
            failure(Status.INVALID_ARGUMENT) { head.mesh(HeadMesh.Config(99)) }
            failure(Status.INVALID_ARGUMENT) { head.mesh(HeadMesh.Config(cellM = 1.0)) }
            val meshes = listOf(coarse, HeadMesh.Config(cellM = 0.01)).map { config -> config to head.mesh(config) }
            val threads = meshes.map { (config, expected) ->
                var same = 0
                thread {
                    repeat(10) { head.mesh(config).use { if (it.positions == expected.positions) ++same } }
                } to { same }
            }
            for ((asking, same) in threads) {
                asking.join()
                assertEquals("each thread gets its own mesh", 10, same())
            }
        }
    }

    @Test
    fun headsAreSavedOpenedAndExported() = TestFiles.inNewFolder<Unit> { folder ->
        head().use { head ->
            val file = File(folder, "jürgen.maqh")
            head.save(file.path)
            maquette.openHead(file.path).use { opened ->
                assertEquals(head.info, opened.info)
                assertEquals(head.landmarks.keys, opened.landmarks.keys)
                for ((name, landmark) in head.landmarks) assertNear(landmark.point, opened.landmarks[name]!!.point)
                assertEquals(head.cameras.map { it.intrinsics }, opened.cameras.map { it.intrinsics })
                assertTrue(opened.mesh(coarse).vertexCount > 300)
            }
            val mesh = head.mesh(coarse)
            for (name in listOf("head.glb", "head.obj", "head.ply")) mesh.save(File(folder, name).path)
            assertEquals("glTF", File(folder, "head.glb").readText().take(4))
            assertTrue(File(folder, "head.ply").readText().startsWith("ply"))
            assertTrue("mtllib head.mtl" in File(folder, "head.obj").readText() && File(folder, "head.mtl").exists())
            failure(Status.INVALID_ARGUMENT) { mesh.save(File(folder, "head.stl").path) }
            failure(Status.UNWRITABLE) { mesh.save(File(folder, "no/head.glb").path) }
            failure(Status.UNWRITABLE) { head.save(File(folder, "no/head.maqh").path) }
            failure(Status.NOT_FOUND) { maquette.openHead(File(folder, "other.maqh").path) }
            failure(Status.UNREADABLE) { maquette.openHead(TestFiles.photo.path) }
        }
    }

    @Test
    fun theAnimatableHeadHasMorphTargetsAndTheTemplateOfABundle() = TestFiles.inNewFolder<Unit> { folder ->
        head().use { head ->
            val mesh = head.mesh()
            assertTrue(mesh.morphTargets.isNotEmpty())
            for (target in mesh.morphTargets) {
                assertTrue(target.name, target.name.isNotEmpty() && target.vertices.isNotEmpty())
                assertEquals(target.vertices.toSortedSet().toList(), target.vertices.toList())
                assertTrue(target.vertices.last() < mesh.vertexCount)
                assertEquals(3 * target.vertices.size, target.deltasM.size)
                assertTrue(target.deltasM.any { it != 0f } && target.deltasM.all { abs(it) < 0.1f })
            }
            val coordinates = mesh.textureCoordinates!!
            assertEquals(2 * mesh.vertexCount, coordinates.remaining())
            assertTrue((0 until coordinates.limit()).all { coordinates[it] in 0f..1f })
            assertNull(mesh.textureJpeg)
            mesh.save(File(folder, "avatar.glb").path)
            assertTrue(mesh.morphTargets[0].name in File(folder, "avatar.glb").readText())

            val file = File(folder, "head.maqh")
            head.save(file.path)
            maquette.openHead(file.path).use { opened ->
                val densePose = ModelBundle.ofFolder(TestFiles.bundle.path)
                failure(Status.UNSUPPORTED) { opened.mesh(HeadMesh.Config(bundle = densePose)) }
                val inMemory = ModelBundle.ofBuffers(TestFiles.bundleInMemory(TestFiles.roundHeadsBundle))
                val again = opened.mesh(HeadMesh.Config(bundle = inMemory))
                assertEquals(mesh.triangles, again.triangles)
                assertNear(mesh.positions, again.positions)
            }
        }
    }

    @Test
    fun aTextureIsMadeUnlessItIsSwitchedOff() {
        head(HeadBuilder.Config(texturePx = 256)).use { head ->
            assertEquals(256, head.info.texturePx)
            val mesh = head.mesh(coarse)
            maquette.decode(mesh.textureJpeg!!).use { assertEquals(256 to 256, it.widthPx to it.heightPx) }
            val coordinates = mesh.textureCoordinates!!
            assertEquals(2 * mesh.vertexCount, coordinates.remaining())
            assertTrue((0 until coordinates.limit()).all { coordinates[it] in 0f..1f })
            maquette.decode(head.mesh().textureJpeg!!).use { assertEquals(512 to 512, it.widthPx to it.heightPx) }
        }
        val on = HeadBuilder.Config()
        val small = on.copy(texturePx = 255)
        assertTrue("255" in failure(Status.INVALID_ARGUMENT) { maquette.headBuilder(bundle, small) })
        failure(Status.INVALID_ARGUMENT) { maquette.headBuilder(bundle, on.copy(texturePx = -1)) }
        failure(Status.INVALID_ARGUMENT) { maquette.headBuilder(bundle, HeadBuilder.Config(texture = HeadBuilder.Texture.OFF, texturePx = 512)) }
    }

    @Test
    fun aDistanceOrDepthThatIsKnownGivesTheSize() {
        fun pupilsM(of: Head): Double {
            val (p, q) = listOf("pupil_left", "pupil_right").map { of.landmarks[it]!!.point }
            return length(Point3(p.x - q.x, p.y - q.y, p.z - q.z))
        }
        head().use { head ->
            val given = head.scaledByDistance("pupil_left", "pupil_right", 0.07)
            assertEquals(0.07, pupilsM(given), 1e-9)
            assertEquals(Head.Scale.GIVEN, given.info.scale)
            assertEquals(Head.Scale.PRIOR, head.info.scale)
            failure(Status.INVALID_ARGUMENT) { head.scaledByDistance("chin", "chin", 0.07) }
            failure(Status.NOT_FOUND) { head.scaledByDistance("chin", "elbow", 0.07) }

            val seen = maquette.headRenderer(given.mesh(coarse)).use { renderer ->
                renderer.run(given.cameras.single()).use { image ->
                    val depth = image.plane(RenderedImage.Plane.DEPTH).asFloatBuffer()
                    val shorts = ByteBuffer.allocateDirect(2 * 320 * 240).order(ByteOrder.nativeOrder())
                    repeat(320 * 240) { shorts.putShort((1000 * depth[it]).toInt().toShort()) }
                    shorts
                }
            }
            maquette.frame(PixelFormat.DEPTH16, 320, 240, Plane(seen)).use { depth ->
                val measured = head.scaledByDepth(depth)
                assertEquals(0.07, pupilsM(measured), 3e-4)
                assertEquals(Head.Scale.DEPTH, measured.info.scale)
                failure(Status.INVALID_ARGUMENT) { head.scaledByDepth(depth, camera = 1) }
            }
            photo().use { assertTrue("not depth" in failure(Status.INVALID_ARGUMENT) { head.scaledByDepth(it) }) }
        }
    }

    @Test
    fun headsAreOpenedFromMemory() = TestFiles.inNewFolder<Unit> { folder ->
        val head = head()
        head.save(File(folder, "a.maqh").path)
        val bytes = File(folder, "a.maqh").readBytes()
        maquette.openHead(TestFiles.direct(bytes)).use { opened ->
            assertEquals(head.landmarks.keys, opened.landmarks.keys)
            opened.save(File(folder, "b.maqh").path)
        }
        assertEquals(bytes.toList(), File(folder, "b.maqh").readBytes().toList())
        val cut = TestFiles.direct(bytes.copyOf(bytes.size - 1))
        assertTrue("The head in memory" in failure(Status.UNREADABLE) { maquette.openHead(cut) })
        failure(Status.INVALID_ARGUMENT) { maquette.openHead(ByteBuffer.wrap(bytes)) }
    }

    @Test
    fun aFitIsCancelledAndWhatItsCallbacksThrowComesOutOfIt() =
        withBuilder<Unit> { builder ->
            failure(Status.CANCELLED) { builder.fit(20.0) { _, _ -> false } }
            var told = 0
            failure(Status.CANCELLED) { builder.fit(20.0) { _, _ -> ++told < 3 } }
            assertEquals(3, told)
            assertThrows(ArithmeticException::class.java) { builder.fit(20.0) { _, _ -> throw ArithmeticException() } }
            assertThrows(ArithmeticException::class.java) {
                builder.fit(20.0, previewIntervalS = 0.0, preview = { throw ArithmeticException() })
            }
            assertThrows(ArithmeticException::class.java) { // at the very end, too
                builder.fit(0.0) { done, _ -> if (done == 1.0) throw ArithmeticException() else true }
            }
            builder.cancel()
            failure(Status.CANCELLED) { builder.fit(20.0) }
            val cancelling = thread {
                Thread.sleep(100)
                builder.cancel()
            }
            var refused = 0
            soon {
                val outcome = runCatching {
                    builder.fit(3600.0) { _, _ ->
                        if (runCatching { builder.stats }.isFailure) ++refused
                        true
                    }
                }
                cancelling.join()
                // It may have ended before, and the next one is cancelled.
                val cancelled = (if (outcome.isSuccess) runCatching { builder.fit(0.0) } else outcome).exceptionOrNull()
                assertEquals(Status.CANCELLED, (cancelled as MaquetteException).status)
            }
            assertTrue("the builder is in use", refused > 0)
            assertEquals(1, builder.fit(0.0).use { it.info.photos })
            failure(Status.INVALID_ARGUMENT) { builder.fit(-1.0) }
            failure(Status.INVALID_ARGUMENT) { builder.fit(Double.NaN) }
            failure(Status.INVALID_ARGUMENT) { builder.fit(1.0, previewIntervalS = -1.0, preview = { it.close() }) }
        }

    @Test
    fun previewsAreHeads() =
        withBuilder<Unit> { builder ->
            val crowns = mutableListOf<Point3>()
            val kept = mutableListOf<Head>()
            builder.fit(0.3, previewIntervalS = 0.0, preview = { head ->
                crowns.add(head.landmarks["crown"]!!.point)
                if (kept.isEmpty()) kept.add(head) else head.close()
            }).close()
            assertTrue("${crowns.size} previews", crowns.size > 1)
            builder.fit(0.3).close()
            val shown = crowns.size
            builder.close()
            assertEquals("only of the fit that they were asked of", shown, crowns.size)
            assertTrue(kept.single().mesh(coarse).vertexCount > 300)
            kept.single().close()
        }

    @Test
    fun photosWithoutAHeadAndThoseOfAnotherAreTold() =
        maquette.headBuilder(bundle).use<HeadBuilder, Unit> { builder ->
            failure(Status.INVALID_ARGUMENT) { builder.fit(0.0) }
            photo(0, 0, 0).use { black ->
                assertTrue("No head" in failure(Status.NOT_FOUND) { builder.addPhoto(black, box) })
                failure(Status.NOT_FOUND) { builder.addPhoto(black) }
            }
            assertTrue(builder.photos.isEmpty())
            photo().use { photo ->
                builder.addPhoto(photo) // without a box it is detected
                val found = builder.photos.single()
                assertEquals(160f, (found.box.left + found.box.right) / 2, 15f)
                assertFalse("not yet", found.isUsed)
                builder.clear()
                builder.addPhoto(photo, box, focalPx = 777f)
                photo(200, 60, 20).use { builder.addPhoto(it, box) }
                builder.addPhoto(photo, HeadBox(100f, 50f, 190f, 170f), rollRad = 0.1f)
                assertEquals(2, builder.fit(0.0).use { it.cameras.size })
                assertEquals(listOf(true, false, true), builder.photos.map { it.isUsed })
                assertEquals(777f, builder.photos[0].focalPx)
                assertEquals(0f, builder.photos[1].focalPx)
                assertEquals(3 to 2, builder.stats.photos to builder.stats.usedPhotos)

                val none = HeadBox(0f, 0f, 0f, 0f)
                assertThrows(IllegalArgumentException::class.java) { builder.addPhoto(photo, none) }
                assertThrows(IllegalArgumentException::class.java) { builder.addPhoto(photo, focalPx = 0f) }
                failure(Status.INVALID_ARGUMENT) { builder.addPhoto(photo, box, focalPx = -1f) }
                failure(Status.INVALID_ARGUMENT) { builder.addPhoto(photo, box, rollRad = Float.NaN) }
                failure(Status.INVALID_ARGUMENT) { builder.addPhoto(photo, HeadBox(400f, 0f, 500f, 90f)) }
                builder.cancel()
                failure(Status.CANCELLED) { builder.addPhoto(photo, box) }
                assertEquals(3, builder.photos.size)
            }
            val depth = ByteBuffer.allocateDirect(2 * 320 * 240)
            maquette.frame(PixelFormat.DEPTH16, 320, 240, Plane(depth)).use {
                failure(Status.UNSUPPORTED) { builder.addPhoto(it, box) }
            }
            failure(Status.UNSUPPORTED) { maquette.headBuilder(ModelBundle.ofFolder(TestFiles.bundle.path)) }
            failure(Status.NOT_FOUND) { maquette.headBuilder(ModelBundle.ofFolder("/nowhere")) }
        }

    @Test
    fun imagesHavePlanesAndLieOnThePhoto() {
        head().use { head ->
            maquette.headRenderer(head.mesh(coarse)).use { renderer ->
                renderer.run(renderer.camera(widthPx = 160, heightPx = 120)).use { image ->
                    assertEquals(160 to 120, image.widthPx to image.heightPx)
                    val middle = 60 * 160 + 80
                    val alpha = image.plane(RenderedImage.Plane.ALPHA)
                    val bgr = image.plane(RenderedImage.Plane.BGR)
                    val depth = image.plane(RenderedImage.Plane.DEPTH).asFloatBuffer()
                    val normals = image.plane(RenderedImage.Plane.NORMALS).asFloatBuffer()
                    val points = image.plane(RenderedImage.Plane.TEMPLATE_POINTS).asFloatBuffer()
                    assertTrue(alpha.isReadOnly)
                    assertEquals(160 * 120, alpha.capacity())
                    assertEquals(listOf(0, -1), listOf(alpha[0].toInt(), alpha[middle].toInt()))
                    assertEquals(0f, depth[0])
                    assertTrue("${depth[middle]}", depth[middle] in 0.2f..2f)
                    assertTrue("towards the camera", normals[3 * middle + 2] < -0.8f)
                    assertTrue("the front of the template head", points[3 * middle + 2] > 0.05f)
                    val opaque = image.toBitmap()
                    val cut = image.toBitmap(withAlpha = true)
                    assertEquals(0xFF shl 24, opaque.getPixel(0, 0))
                    assertEquals(0, cut.getPixel(0, 0))
                    for (picture in listOf(opaque, cut)) {
                        val pixel = picture.getPixel(80, 60)
                        val channels = List(4) { pixel shr (8 * it) and 0xFF }
                        assertEquals(List(3) { bgr[3 * middle + it].toInt() and 0xFF } + 255, channels)
                    }
                    TestFiles.inNewFolder { folder ->
                        image.save(File(folder, "head.png").path, withAlpha = true)
                        image.save(File(folder, "head.jpg").path)
                        failure(Status.INVALID_ARGUMENT) { image.save(File(folder, "a.jpg").path, withAlpha = true) }
                        assertEquals(setOf("head.png", "head.jpg"), folder.list()!!.toSet())
                    }
                }
                renderer.run(head.cameras.single()).use { image ->
                    val alpha = image.plane(RenderedImage.Plane.ALPHA)
                    val columns = (0 until 320 * 240).filter { alpha[it].toInt() != 0 }.map { it % 320 }
                    assertEquals("the middle of the box", 154.5, columns.average(), 5.0)
                }
                val camera = renderer.camera(yawRad = 0.4, pitchRad = 0.1, widthPx = 80, heightPx = 60)
                val pictures = HeadRenderer.Shading.entries.map { shading ->
                    renderer.setShading(shading)
                    val colours = ByteArray(3 * 80 * 60)
                    renderer.run(camera).use { image -> image.plane(RenderedImage.Plane.BGR).get(colours) }
                    colours
                }
                assertEquals(5, pictures.map(ByteArray::toList).toSet().size)
                failure(Status.IMAGE_SIZE) { renderer.camera(widthPx = 0) }
                failure(Status.INVALID_ARGUMENT) { renderer.camera(yawRad = Double.NaN) }
                val bent = camera.copy(intrinsics = camera.intrinsics.copy(distortion = List(8) { 0.1 }))
                failure(Status.INVALID_ARGUMENT) { renderer.run(bent) }
            }
            val wrong = HeadRenderer.Config(shadingStrength = 2f)
            failure(Status.INVALID_ARGUMENT) { maquette.headRenderer(head.mesh(coarse), wrong) }
        }
    }

    @Test
    fun objectsAreClosedInAnyOrderAndNotUsedAfterwards() {
        val ofThem = Maquette()
        val builder = ofThem.headBuilder(bundle)
        photo().use { builder.addPhoto(it, box) }
        val head = builder.fit(0.0)
        val config = HeadRenderer.Config(background = 0x102030, imagePoolSize = 1)
        val mesh = head.mesh(coarse)
        val renderer = ofThem.headRenderer(mesh, config)
        ofThem.close()
        assertClosed { ofThem.headBuilder(bundle) }
        assertClosed { ofThem.openHead("head.maqh") }
        assertClosed { ofThem.headRenderer(mesh) }
        builder.close()
        builder.close()
        for (use in listOf<() -> Unit>(builder::clear, builder::cancel, { builder.fit(0.0) }, { builder.photos })) {
            assertClosed(use)
        }
        head.close()
        assertClosed { head.mesh() }
        assertClosed { head.save("head.maqh") }
        mesh.close()
        assertClosed { mesh.save("head.glb") }
        assertClosed { maquette.headRenderer(mesh) }
        assertEquals("what was read stays", 5, head.landmarks.size)
        val image = renderer.run(renderer.camera(widthPx = 64, heightPx = 48))
        failure(Status.POOL_EMPTY) { renderer.run(renderer.camera()) }
        renderer.close()
        assertClosed { renderer.camera() }
        assertClosed { renderer.setShading(HeadRenderer.Shading.SHAPE) }
        assertEquals("the background", 0x102030, image.toBitmap().getPixel(0, 0) and 0xFFFFFF)
        image.close()
        assertClosed { image.plane(RenderedImage.Plane.BGR) }
        assertClosed { image.toBitmap() }
        val closed = photo().apply { close() }
        maquette.headBuilder(bundle).use { assertClosed { it.addPhoto(closed) } }
    }

    @Test
    fun tenThousandHeadsLeaveNothing() = TestFiles.inNewFolder<Unit> { folder ->
        val file = File(folder, "head.maqh")
        head().use { it.save(file.path) }
        fun open(count: Int) = repeat(count) { maquette.openHead(file.path).close() }
        open(1000)
        val before = residentMiB()
        open(9000)
        assertTrue("${residentMiB() - before} MiB more", residentMiB() - before < 40)
    }

    @Test
    fun theShippedNetworksSeeTheHeadOfThePhotosPerson() {
        maquette.decode(TestFiles.photo.readBytes()).use { photo ->
            val head = maquette.densePose(ModelBundle.ofFolder(TestFiles.bundle.path)).use { densePose ->
                densePose.run(photo).use { people ->
                    val found = people.headBox(0)!!
                    val overlap = overlap(found, HeadBox(152f, 12f, 302f, 190f))
                    assertTrue("$found: $overlap of the head's true box", overlap > 0.8f)
                    failure(Status.INVALID_ARGUMENT) { people.headBox(people.people.size) }
                    failure(Status.INVALID_ARGUMENT) { people.headBox(-1) }
                    maquette.headBuilder(ModelBundle.ofFolder(TestFiles.headsBundle.path)).use { builder ->
                        builder.addPhoto(photo, found)
                        assertTrue(builder.photos.single().headCoverage > 0.1f)
                        builder.fit(0.0) to found
                    }
                }
            }
            val (made, found) = head
            made.use {
                val nose = made.landmarks["nose_tip"]!!.point
                val (x, y) = made.cameras.single().pixel(nose)
                assertTrue("($x, $y) in $found", x > found.left && x < found.right && y > found.top && y < found.bottom)
                assertEquals(12, made.landmarks.size)
                assertEquals(52 + 15, made.mesh().morphTargets.size)
            }
        }
    }

    private fun PinholeCamera.pixel(p: Point3): Pair<Double, Double> {
        val d = listOf(p.x - centre[0], p.y - centre[1], p.z - centre[2])
        val (x, y, z) = List(3) { row -> (0..2).sumOf { rotation[3 * row + it] * d[it] } }
        return with(intrinsics) { fxPx * x / z + cxPx to fyPx * y / z + cyPx }
    }
}
