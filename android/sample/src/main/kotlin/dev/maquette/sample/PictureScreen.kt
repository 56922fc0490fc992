package dev.maquette.sample

import android.content.Intent
import android.graphics.Bitmap
import android.graphics.ImageDecoder
import android.net.Uri
import android.os.Build
import android.provider.MediaStore

/** A screen for which the user picks pictures. */
abstract class PictureScreen : Screen() {
    /** Asks for an image, which [onPicked] gets. */
    protected fun pickImage(request: Int) {
        val pick = Intent(Intent.ACTION_GET_CONTENT).addCategory(Intent.CATEGORY_OPENABLE).setType("image/*")
        startActivityForResult(pick, request)
    }

    protected abstract fun onPicked(request: Int, image: Uri)

    @Deprecated("the platform's way without androidx")
    override fun onActivityResult(request: Int, result: Int, data: Intent?) {
        data?.data?.let { onPicked(request, it) }
    }

    /** Upright, at most [MAX_SIDE_PX] pixels long. */
    protected open fun decode(image: Uri): Bitmap {
        val bitmap =
            if (Build.VERSION.SDK_INT >= 28) {
                ImageDecoder.decodeBitmap(ImageDecoder.createSource(contentResolver, image)) { decoder, info, _ ->
                    decoder.allocator = ImageDecoder.ALLOCATOR_SOFTWARE
                    decoder.setTargetSampleSize(maxOf(1, maxOf(info.size.width, info.size.height) / MAX_SIDE_PX))
                }
            } else {
                @Suppress("DEPRECATION")
                MediaStore.Images.Media.getBitmap(contentResolver, image)
            }
        return bitmap.copy(Bitmap.Config.ARGB_8888, true)
    }

    private companion object {
        const val MAX_SIDE_PX = 2048
    }
}
