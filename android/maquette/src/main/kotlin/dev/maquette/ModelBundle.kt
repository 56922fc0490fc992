package dev.maquette

import android.content.res.AssetManager
import dev.maquette.jni.*
import java.io.FileInputStream
import java.io.IOException
import java.nio.ByteBuffer
import java.nio.channels.FileChannel

/**
 * Trained networks: the files of a folder with `manifest.json`. Buffers are copied by the call that takes the bundle. A
 * folder is read by that call too; a [Pipeline] reads it when it opens its first source.
 */
class ModelBundle private constructor(private val folder: String?, private val files: Map<String, ByteBuffer>) {
    internal fun writeTo(options: maq_model_options) {
        options.bundle_path.set(folder?.let(::textOf))
        if (files.isEmpty()) return
        options.bundle_file_count = files.size
        options.bundle_files.set(arrayOfFiles())
    }

    private fun arrayOfFiles(): Memory {
        val fileBytes = maq_memory_file().sizeBytes
        val array = Memory(files.size * fileBytes)
        files.entries.forEachIndexed { index, (name, contents) ->
            val file = maq_memory_file(array, index * fileBytes)
            file.name.set(textOf(name))
            file.data.set(Memory(contents))
            file.size_bytes = contents.capacity().toLong()
        }
        return array
    }

    companion object {
        /** A bundle in a folder of the file system. */
        fun ofFolder(path: String) = ModelBundle(path, emptyMap())

        /** A bundle in memory: direct buffers, by file name. */
        fun ofBuffers(files: Map<String, ByteBuffer>) = ModelBundle(null, files.toMap())

        /**
         * A bundle in a folder of the app's assets. Files that are stored without compression (`noCompress`) are
         * mapped, others are read into memory; nothing is written.
         *
         * @throws IOException if the folder is not there; it says which are.
         */
        fun ofAssets(assets: AssetManager, folder: String): ModelBundle {
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

        internal fun mappedOrRead(assets: AssetManager, path: String): ByteBuffer =
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

/** Sets how networks are loaded and run; [bundle] null: without one. */
internal fun maq_model_options.set(
    bundle: ModelBundle?,
    threads: Int = 0,
    provider: DensePose.Provider = DensePose.Provider.CPU,
) {
    bundle?.writeTo(this)
    this.threads = threads
    this.provider = provider.code
}

/** Yes and no of the C API. */
internal fun Boolean.toInt() = if (this) 1 else 0
