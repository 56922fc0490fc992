package dev.maquette

import java.io.File
import java.nio.ByteBuffer

/** What the repository has to test with. */
object TestFiles {
    private val root = File(System.getProperty("maquette.root")!!)
    val bundle = File(root, "sdk/models/densepose-b-int8")
    val photo = File(root, "tests/media/photo.jpg")

    fun bundleInMemory(): Map<String, ByteBuffer> =
        bundle.listFiles()!!.associate { file -> file.name to direct(file.readBytes()) }

    fun direct(bytes: ByteArray): ByteBuffer = ByteBuffer.allocateDirect(bytes.size).apply { put(bytes) }
}
