package dev.maquette

import android.content.res.AssetManager
import java.io.File
import java.io.IOException
import java.nio.ByteBuffer
import java.util.zip.CRC32
import java.util.zip.ZipEntry
import java.util.zip.ZipOutputStream
import org.junit.Assert.assertEquals
import org.junit.Assert.assertNotEquals
import org.junit.Assert.assertThrows
import org.junit.Assert.assertTrue
import org.junit.Test

/** Networks and scenes out of an app's package: an archive with `assets`, compressed or not. */
class AssetsTest : AndroidTest() {
    private val maquette = Maquette()
    private val bundles = listOf(TestFiles.bundle, TestFiles.scenesBundle)

    /** Opens files, by their name in the assets, as those of an app. */
    private fun assetsOf(files: Map<String, ByteArray>, isCompressed: Boolean, folder: File): AssetManager {
        val apk = File.createTempFile("app", ".apk", folder) // Android keeps what it read of a path
        ZipOutputStream(apk.outputStream()).use { zip ->
            for ((name, bytes) in files) {
                val entry = ZipEntry("assets/$name")
                if (!isCompressed) {
                    entry.method = ZipEntry.STORED
                    entry.size = bytes.size.toLong()
                    entry.crc = CRC32().apply { update(bytes) }.value
                }
                zip.putNextEntry(entry)
                zip.write(bytes)
            }
        }
        // Android does this for an app; apps cannot.
        val assets = AssetManager::class.java.getConstructor().newInstance()
        val cookie = AssetManager::class.java.getMethod("addAssetPath", String::class.java).invoke(assets, apk.path)
        assertNotEquals(0, cookie)
        return assets
    }

    private fun shipped(): Map<String, ByteArray> =
        bundles.flatMap { bundle -> bundle.listFiles()!!.map { "${bundle.name}/${it.name}" to it.readBytes() } }.toMap()

    @Test
    fun theShippedNetworksComeFromTheAssets() = TestFiles.inNewFolder { folder ->
        for (isCompressed in listOf(false, true)) {
            val assets = assetsOf(shipped(), isCompressed, folder)
            val isMapped = runCatching { assets.openFd("densepose-b-int8/trunk.onnx").close() }.isSuccess
            assertEquals(!isCompressed, isMapped)
            maquette.densePose(ModelBundle.ofAssets(assets, "densepose-b-int8")).use { densePose ->
                maquette.decode(TestFiles.photo.readBytes()).use { frame ->
                    densePose.run(frame).use { assertEquals(1, it.people.size) }
                }
            }
            maquette.pipeline(ModelBundle.ofAssets(assets, "densepose-b-int8")).use { pipeline ->
                pipeline.setSource("image:${TestFiles.photo.path}")
                pipeline.acquireResult()!!.use { assertEquals(1, it.densePose.people.size) }
            }
        }
    }

    @Test
    fun aSceneComesFromTheAssets() = TestFiles.inNewFolder { folder ->
        val up = listOf(0.0, 0.0, 1.0)
        val networks = ModelBundle.ofFolder(TestFiles.scenesBundle.path)
        val file = File(folder, "dot.maqs")
        maquette.sceneBuilder(PointCloud.of(floatArrayOf(0f, 0f, 3f), up = up), networks).use { builder ->
            val camera = PinholeCamera(
                Intrinsics(32, 32, 32.0, 32.0, 15.5, 15.5),
                listOf(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
                listOf(0.0, 0.0, 0.0),
            )
            val grey = Plane(ByteBuffer.allocateDirect(32 * 32))
            maquette.frame(PixelFormat.GREY8, 32, 32, grey).use { builder.addView(it, camera) }
            builder.finish().use { it.save(file.path) }
        }
        for (isCompressed in listOf(false, true)) {
            val assets = assetsOf(shipped() + ("places/dot.maqs" to file.readBytes()), isCompressed, folder)
            maquette.openScene(assets, "places/dot.maqs").use { scene ->
                assertEquals(1L, scene.info.pointCount)
                maquette.sceneRenderer(scene, ModelBundle.ofAssets(assets, "scenes-int8")).close()
            }
            assertThrows(IOException::class.java) { maquette.openScene(assets, "places/other.maqs") }
        }
    }

    @Test
    fun aHeadComesFromTheAssets() = TestFiles.inNewFolder { folder ->
        val file = File(folder, "head.maqh")
        maquette.headBuilder(ModelBundle.ofFolder(TestFiles.roundHeadsBundle.path)).use { builder ->
            val grey = Plane(ByteBuffer.allocateDirect(320 * 240).apply { repeat(capacity()) { put(it, 130.toByte()) } })
            val box = HeadBox(110f, 60f, 200f, 180f)
            maquette.frame(PixelFormat.GREY8, 320, 240, grey).use { builder.addPhoto(it, box) }
            builder.fit(0.0).use { it.save(file.path) }
        }
        for (isCompressed in listOf(false, true)) {
            val assets = assetsOf(mapOf("heads/a.maqh" to file.readBytes()), isCompressed, folder)
            maquette.openHead(assets, "heads/a.maqh").use { assertEquals(1, it.info.photos) }
            assertThrows(IOException::class.java) { maquette.openHead(assets, "heads/b.maqh") }
        }
    }

    @Test
    fun wrongInputIsAnExceptionThatSaysWhatToDo() = TestFiles.inNewFolder { folder ->
        fun missing(assets: AssetManager, name: String) =
            assertThrows(IOException::class.java) { ModelBundle.ofAssets(assets, name) }.message!!
        val assets = assetsOf(shipped(), isCompressed = true, folder)
        for (name in listOf("densepose", "", "densepose-b-int8/trunk.onnx", "/densepose-b-int8")) {
            val said = missing(assets, name)
            assertTrue(said, "$name/manifest.json" in said && "densepose-b-int8, scenes-int8" in said)
        }
        val none = missing(assetsOf(mapOf("texts/a.txt" to ByteArray(1)), isCompressed = false, folder), "scenes-int8")
        assertTrue(none, "No networks" in none && "sdk/models" in none)
        val damaged = shipped().mapValues { (name, bytes) -> if ("trunk" in name) bytes.copyOf(1000) else bytes }
        for (isCompressed in listOf(false, true)) {
            val bundle = ModelBundle.ofAssets(assetsOf(damaged, isCompressed, folder), "densepose-b-int8")
            val said = failure(Status.BAD_BUNDLE) { maquette.densePose(bundle) }
            assertTrue(said, "trunk.onnx" in said)
        }
    }
}
