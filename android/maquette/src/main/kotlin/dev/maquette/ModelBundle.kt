package dev.maquette

import android.content.res.AssetManager
import java.io.FileInputStream
import java.io.IOException
import java.nio.ByteBuffer
import java.nio.channels.FileChannel

/** Trained networks: the files of a folder with `manifest.json`. Needed only until the networks have been made. */
class ModelBundle private constructor(private val path: String?, private val files: Map<String, ByteBuffer>?) {
    internal fun create(
        context: Long,
        config: DensePose.Config,
    ): Long {
        val names = files?.keys?.map { it.toByteArray() }?.toTypedArray()
        return Native.createDensePose(
            context,
            path?.toByteArray(),
            names,
            files?.values?.toTypedArray(),
            config.threads,
            config.longSidePx,
            config.scoreThreshold,
            config.maxPeople,
            config.resultPoolSize,
            config.maxProposals,
            config.keyFrameInterval,
            config.minPersonHeightPx,
            config.detail.ordinal,
            config.allowSpinning,
            config.personCrops.ordinal,
            config.personCropPx,
        )
    }

    companion object {
        /** A bundle in a folder of the file system. */
        fun ofFolder(path: String) = ModelBundle(path, null)

        /** A bundle in memory: direct buffers, by file name. */
        fun ofBuffers(files: Map<String, ByteBuffer>) = ModelBundle(null, files.toMap())

        /**
         * A bundle in a folder of the app's assets. Files that are stored without compression (`noCompress`) are
         * mapped, others are read into memory; nothing is written.
         *
         * @throws IOException if the folder is not there.
         */
        fun ofAssets(
            assets: AssetManager,
            folder: String,
        ): ModelBundle {
            val names = assets.list(folder).orEmpty()
            if ("manifest.json" !in names) throw IOException("The assets have no $folder/manifest.json.")
            return ofBuffers(names.associateWith { mappedOrRead(assets, "$folder/$it") })
        }

        private fun mappedOrRead(
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
