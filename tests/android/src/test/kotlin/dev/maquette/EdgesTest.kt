package dev.maquette

import java.io.File
import java.nio.ByteOrder
import kotlin.math.abs
import kotlin.math.sqrt
import org.junit.Assert.assertArrayEquals
import org.junit.Assert.assertEquals
import org.junit.Assert.assertNull
import org.junit.Assert.assertTrue
import org.junit.Test

class EdgesTest : AndroidTest() {
    private val networks = ModelBundle.ofFolder(TestFiles.edgesBundle.path)

    /** Runs [work] with the edges of a simulated box, a metre away. */
    private fun withBox(config: Edges.Config = Edges.Config(), work: (Maquette, Edges, Frame, Intrinsics) -> Unit) =
        Maquette().use { maquette ->
            maquette.source("stub:solids?scene=box&noise=none&size=320x240&seed=1").use { source ->
                source.acquireFrame()!!.use { frame ->
                    maquette.edges(networks, config).use { work(maquette, it, frame, source.intrinsics!!) }
                }
            }
        }

    private fun length(p: Point3, q: Point3) =
        sqrt((p.x - q.x) * (p.x - q.x) + (p.y - q.y) * (p.y - q.y) + (p.z - q.z) * (p.z - q.z))

    @Test
    fun aBoxIsMeasuredSnappedToAndSaved() =
        withBox { _, edges, frame, intrinsics ->
            val result = edges.run(frame)
            val found = result.use { it.findCurves() }
            found.use {
                val box = found.boxes.single()
                assertEquals(box.sizeM.sortedDescending(), box.sizeM)
                assertTrue("${box.sizeM}", box.sizeM.all { it in 0.3..0.5 })
                assertTrue(box.sizeToleranceM.all { it >= 0 } && box.cornersSeen in 4..8)
                for (axis in box.axes) assertEquals(1.0, length(axis, Point3(0.0, 0.0, 0.0)), 1e-6)
                val line = found.curves.first { it.type == EdgeCurves.Type.LINE }
                assertEquals(line.lengthM, length(line.points.first(), line.points.last()), 1e-6)
                assertTrue(line.kind != EdgesResult.Kind.NONE && line.rmsFootprints >= 0)
                val ends = found.curves.flatMap { listOf(it.startCorner, it.endCorner) }.filter { it >= 0 }
                assertTrue(ends.all { it in found.corners.indices })
                for ((index, corner) in found.corners.withIndex()) {
                    assertEquals(corner.curveCount, ends.count { it == index })
                }
                val corner = found.corners.first().point
                val x = corner.x / corner.z * intrinsics.fxPx + intrinsics.cxPx
                val y = corner.y / corner.z * intrinsics.fyPx + intrinsics.cyPx
                val snap = found.snap(x, y)
                assertEquals(EdgeCurves.Target.CORNER, snap.target)
                assertEquals(corner, found.corners[snap.index].point)
                assertEquals(corner, snap.point)
                assertEquals(EdgeCurves.Target.NOTHING, found.snap(-900.0, -900.0, 1.0).target)
                failure(Status.INVALID_ARGUMENT) { found.snap(x, y, -1.0) }
                TestFiles.inNewFolder { folder ->
                    val file = File(folder, "box.step")
                    found.save(file.path)
                    assertTrue(file.readText().startsWith("ISO-10303-21"))
                    failure(Status.INVALID_ARGUMENT) { found.save(File(folder, "box.blend").path) }
                }
            }
            assertClosed { result.findCurves() }
            assertClosed { found.snap(0.0, 0.0) }
            assertTrue(found.boxes.isNotEmpty() && found.curvesMs > 0) // copies stay
        }

    @Test
    fun planesHaveTheFramesSize() =
        withBox { _, edges, frame, intrinsics ->
            edges.run(frame).use { result ->
                assertEquals(320 to 240, result.widthPx to result.heightPx)
                assertEquals(intrinsics, result.intrinsics)
                assertEquals(16.0, result.epsR, 0.0)
                val distance = result.copyPlane(EdgesResult.Plane.DISTANCE)
                assertTrue(distance.all { it in 0f..16f } && distance.min() < 1f)
                val view = result.plane(EdgesResult.Plane.DISTANCE)
                assertTrue(view.isReadOnly)
                for (k in distance.indices step 101) assertEquals(distance[k], view[k])
                val depth = frame.copyDepth()!!
                assertEquals(320 to 240, depth.widthPx to depth.heightPx)
                assertArrayEquals(depth.metres, result.copyPlane(EdgesResult.Plane.DEPTH), 0f)
                val kinds = result.copyKinds()
                assertTrue(kinds.all { it in 0..2 } && listOf(1, 2).all { it.toByte() in kinds })
                for (k in kinds.indices) if (distance[k] == 16f) assertEquals(0, kinds[k].toInt())
                val stats = result.stats
                assertEquals(depth.metres.count { it > 0 }.toLong(), stats.knownPixels)
                assertTrue(stats.totalMs > 0 && stats.networkPixels > 0 && stats.threads > 0)
                TestFiles.inNewFolder { folder ->
                    result.save(File(folder, "box").path)
                    assertEquals(setOf("box_distance.png", "box_kind.png", "box_edges.json"), folder.list()!!.toSet())
                }
            }
        }

    @Test
    fun depthOfTheAppInMillimetresIsTheSameScene() =
        withBox { maquette, edges, frame, intrinsics ->
            val metres = frame.copyDepth()!!.metres
            val bytes = TestFiles.direct(ByteArray(2 * metres.size)).order(ByteOrder.nativeOrder())
            metres.forEachIndexed { k, z -> bytes.putShort(2 * k, (1000 * z + 0.5f).toInt().toShort()) }
            assertEquals(intrinsics, frame.intrinsics)
            maquette.frame(PixelFormat.DEPTH16, 320, 240, Plane(bytes), intrinsics = intrinsics).use { own ->
                assertEquals(intrinsics, own.intrinsics)
                val depth = own.copyDepth()!!
                for (k in metres.indices) assertTrue(abs(depth.metres[k] - metres[k]) < 5.1e-4f)
                val (exact, rounded) = listOf(frame, own).map { from ->
                    edges.run(from).use { result ->
                        result.findCurves().use { found -> found.boxes.single().sizeM }
                    }
                }
                for (k in exact.indices) assertEquals(exact[k], rounded[k], 0.005)
            }
        }

    @Test
    fun whatIsNotAskedForIsLeftOut() =
        withBox(Edges.Config(skipPlanes = true)) { _, edges, frame, intrinsics ->
            edges.run(frame).use { result ->
                result.findCurves(EdgeCurves.Config(skipBoxes = true)).use { found ->
                    assertTrue(found.boxes.isEmpty() && found.curves.isNotEmpty())
                }
                failure(Status.INVALID_ARGUMENT) { result.findCurves(EdgeCurves.Config(minLengthPx = -1f)) }
            }
        }

    @Test
    fun framesAtRestAreAveragedWhenAskedFor() =
        withBox(Edges.Config(averageFrames = 8)) { _, edges, frame, intrinsics ->
            edges.run(frame).use { assertEquals(0L, it.stats.averagedPixels) }
            edges.run(frame).use { assertEquals(it.stats.knownPixels, it.stats.averagedPixels) }
        }

    @Test
    fun wrongInputIsExplained() =
        withBox(Edges.Config(resultPoolSize = 2)) { maquette, edges, frame, intrinsics ->
            maquette.decode(TestFiles.photo.readBytes()).use { photo ->
                assertNull(photo.copyDepth())
                assertNull(photo.intrinsics)
                assertTrue("depth" in failure(Status.UNSUPPORTED) { edges.run(photo) })
            }
            fun wrapped(camera: Intrinsics?) =
                maquette.frame(
                    PixelFormat.DEPTH16, 320, 240, Plane(TestFiles.direct(ByteArray(2 * 320 * 240))), intrinsics = camera,
                )
            val other = intrinsics.copy(widthPx = 640)
            assertTrue("640" in failure(Status.INVALID_ARGUMENT) { wrapped(other) })
            wrapped(intrinsics.copy(fxPx = 0.0)).use { assertTrue("fx_px" in failure(Status.INVALID_ARGUMENT) { edges.run(it) }) }
            wrapped(null).use { assertTrue("intrinsics" in failure(Status.UNSUPPORTED) { edges.run(it) }) }
            val held = List(2) { edges.run(frame) }
            failure(Status.POOL_EMPTY) { edges.run(frame) }
            held.forEach(EdgesResult::close)
            edges.cancel()
            failure(Status.CANCELLED) { edges.run(frame) }
            edges.run(frame).close()
            val people = ModelBundle.ofFolder(TestFiles.bundle.path)
            failure(Status.UNSUPPORTED) { maquette.edges(people) }
            failure(Status.NOT_FOUND) { maquette.edges(ModelBundle.ofFolder("/nowhere")) }
            edges.close()
            assertClosed { edges.run(frame) }
        }

    @Test
    fun aBundleInMemoryGivesTheSame() =
        withBox { maquette, edges, frame, intrinsics ->
            val buffers = ModelBundle.ofBuffers(TestFiles.bundleInMemory(TestFiles.edgesBundle))
            val distances = maquette.edges(buffers).use { other ->
                listOf(edges, other).map { model ->
                    model.run(frame).use { it.copyPlane(EdgesResult.Plane.DISTANCE) }
                }
            }
            assertArrayEquals(distances[0], distances[1], 0f)
        }
}
