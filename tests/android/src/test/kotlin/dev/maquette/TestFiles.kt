package dev.maquette

import java.io.File
import java.nio.ByteBuffer
import java.nio.file.Files

/** Files of the repository for tests. */
object TestFiles {
    private val root = File(System.getProperty("maquette.root")!!)
    val bundle = File(root, "sdk/models/densepose-b-int8")
    val scenesBundle = File(root, "sdk/models/scenes-int8")
    val bodyBundle = File(root, "sdk/models/body")
    val edgesBundle = File(root, "sdk/models/edges-int8")
    val headsBundle = File(root, "sdk/models/heads-int8")
    val predictionBundle = File(root, "sdk/models/prediction-int8")
    val roundHeadsBundle = File(root, "tests/native/data/round_heads/bundle")
    val photo = File(root, "tests/media/photo.jpg")
    val clip = File(root, "tests/media/clip.mp4")
    val room = File(root, "tests/media/room")

    fun bundleInMemory(folder: File = bundle): Map<String, ByteBuffer> =
        folder.listFiles()!!.associate { file -> file.name to direct(file.readBytes()) }

    fun direct(bytes: ByteArray): ByteBuffer = ByteBuffer.allocateDirect(bytes.size).apply { put(bytes) }

    /** Runs [work] with a folder that is deleted afterwards. */
    fun <T> inNewFolder(work: (File) -> T): T {
        val folder = Files.createTempDirectory("maquette-test").toFile()
        try {
            return work(folder)
        } finally {
            folder.deleteRecursively()
        }
    }
}
