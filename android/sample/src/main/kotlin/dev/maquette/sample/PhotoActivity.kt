package dev.maquette.sample

import android.content.Intent
import android.graphics.Bitmap
import android.graphics.Canvas
import android.graphics.ImageDecoder
import android.net.Uri
import android.os.Bundle
import android.provider.MediaStore
import dev.maquette.DensePose

/** The people of a photo that the user picks. */
open class PhotoActivity : Screen() {
    private val densePose by lazy {
        val config = DensePose.Config(longSidePx = 384, personCrops = DensePose.PersonCrops.AUTO)
        maquette.densePose(networks("densepose-b-int8"), config)
    }

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        say("Choose a photo. It stays on this device.")
        button("Choose a photo") {
            val pick = Intent(Intent.ACTION_GET_CONTENT).addCategory(Intent.CATEGORY_OPENABLE).setType("image/*")
            startActivityForResult(pick, 1)
        }
    }

    @Deprecated("the platform's way without androidx")
    override fun onActivityResult(
        request: Int,
        result: Int,
        data: Intent?,
    ) {
        val photo = data?.data ?: return
        say("Looking for people …")
        inBackground({ process(decode(photo)) }) { (bitmap, count, ms) ->
            show(bitmap, "The photo, ${people(count)} painted by body part")
            say("%s in %.0f ms".format(people(count), ms))
        }
    }

    override fun close() {
        densePose.close()
        super.close()
    }

    /** Upright, at most [MAX_SIDE_PX] pixels long. */
    protected open fun decode(photo: Uri): Bitmap {
        val bitmap =
            if (android.os.Build.VERSION.SDK_INT >= 28) {
                ImageDecoder.decodeBitmap(ImageDecoder.createSource(contentResolver, photo)) { decoder, info, _ ->
                    decoder.allocator = ImageDecoder.ALLOCATOR_SOFTWARE
                    decoder.setTargetSampleSize(maxOf(1, maxOf(info.size.width, info.size.height) / MAX_SIDE_PX))
                }
            } else {
                @Suppress("DEPRECATION")
                MediaStore.Images.Media.getBitmap(contentResolver, photo)
            }
        return bitmap.copy(Bitmap.Config.ARGB_8888, true)
    }

    private fun process(photo: Bitmap): Triple<Bitmap, Int, Double> =
        maquette.frame(photo).use { frame ->
            densePose.run(frame).use { result ->
                Canvas(photo).drawBitmap(result.overlay(), 0f, 0f, null)
                Triple(photo, result.people.size, result.stats.totalMs)
            }
        }

    private companion object {
        const val MAX_SIDE_PX = 2048
    }
}
