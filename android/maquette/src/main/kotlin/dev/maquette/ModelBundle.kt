package dev.maquette

import android.content.res.AssetManager
import java.io.FileInputStream
import java.io.IOException
import java.nio.ByteBuffer
import java.nio.channels.FileChannel

/**
 * Trained networks: the files of a folder with `manifest.json`. Buffers are copied by the call that takes the bundle. A
 * folder is read by that call too; a [Pipeline] reads it when it opens its first source.
 */
class ModelBundle private constructor(folder: String?, files: Map<String, ByteBuffer>?) {
    internal val folder = folder?.toByteArray()
    internal val names = files?.keys?.map(String::toByteArray)?.toTypedArray()
    internal val buffers = files?.values?.toTypedArray()

    companion object {
        /** A bundle in a folder of the file system. */
        fun ofFolder(path: String) = ModelBundle(path, null)

        /** A bundle in memory: direct buffers, by file name. */
        fun ofBuffers(files: Map<String, ByteBuffer>) = ModelBundle(null, files.toMap())

        /**
         * A bundle in a folder of the app's assets. Files that are stored without compression (`noCompress`) are
         * mapped, others are read into memory; nothing is written.
         *
         * @throws IOException if the folder is not there; it says which are.
         */
        fun ofAssets(
            assets: AssetManager,
            folder: String,
        ): ModelBundle {
            val names = assets.list(folder).orEmpty()
            if (MANIFEST !in names) throw IOException("The assets have no $folder/$MANIFEST. ${thoseThere(assets)}")
            return ofBuffers(names.associateWith { mappedOrRead(assets, "$folder/$it") })
        }

        private fun thoseThere(assets: AssetManager): String {
            // Folders; but the files in them in tests of an app by Robolectric.
            val folders = assets.list("").orEmpty().map { it.substringBefore('/') }.toSet()
            val others = folders.filter { MANIFEST in assets.list(it).orEmpty() }
            if (others.isNotEmpty()) return "Networks are in ${others.sorted().joinToString()}."
            return "No networks are in the assets: add folders of sdk/models to them, or a library that has them."
        }

        private const val MANIFEST = "manifest.json"

        internal fun mappedOrRead(
            assets: AssetManager,
            path: String,
        ): ByteBuffer =
            try {
                assets.openFd(path).use { file ->
                    FileInputStream(file.fileDescriptor).use { stream ->
                        stream.channel.map(FileChannel.MapMode.READ_ONLY, file.startOffset, file.length)
                    }
                }
            } catch (_: IOException) { // compressed
                val bytes = assets.open(path).use { it.readBytes() }
                ByteBuffer.allocateDirect(bytes.size).apply { put(bytes) }
            }
    }
}
