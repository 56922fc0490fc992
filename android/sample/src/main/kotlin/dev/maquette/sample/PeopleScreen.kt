package dev.maquette.sample

import android.content.Intent
import android.graphics.Bitmap
import android.graphics.BitmapFactory
import android.graphics.Canvas
import android.graphics.ImageDecoder
import android.net.Uri
import android.os.Build
import android.provider.MediaStore
import android.widget.Button
import dev.maquette.BodySurface
import dev.maquette.DensePoseResult

/** A screen of people, painted by body part or dressed. */
abstract class PeopleScreen : Screen() {
    /** What people wear; null: they are painted by body part. */
    @Volatile
    private var worn: Bitmap? = null

    /** Of the thread that paints; with the picture that it was made of. */
    private var outfit: Pair<Bitmap, Outfit>? = null
    private lateinit var mode: Button

    protected fun addModeButtons() {
        mode =
            button(TRY_ON) {
                if (worn != null) wear(null) else inBackground({ defaultOutfit() }, ::wear)
            }
        button("Wear a picture") { pickImage(OUTFIT) }
    }

    /** What is worn has changed. */
    protected open fun onModeChanged() = Unit

    protected open fun defaultOutfit(): Bitmap = assets.open("outfit.png").use(BitmapFactory::decodeStream)

    private fun wear(picture: Bitmap?) {
        worn = picture
        mode.text = if (picture == null) TRY_ON else BODY_PARTS
        onModeChanged()
    }

    /**
     * Paints the people over their picture.
     *
     * @param surface of the networks that found them.
     * @return how, for those who do not see it.
     */
    protected fun paint(
        picture: Bitmap,
        people: DensePoseResult,
        surface: () -> BodySurface?,
    ): String {
        val wears = worn
        if (wears == null) {
            Canvas(picture).drawBitmap(people.overlay(), 0f, 0f, null)
            return "painted by body part"
        }
        val made = outfit?.takeIf { it.first === wears } ?: (wears to Outfit(wears, surface())).also { outfit = it }
        made.second.dress(picture, people)
        return "dressed by a picture"
    }

    /** Asks for an image, which [onPicked] gets. */
    protected fun pickImage(request: Int) {
        val pick = Intent(Intent.ACTION_GET_CONTENT).addCategory(Intent.CATEGORY_OPENABLE).setType("image/*")
        startActivityForResult(pick, request)
    }

    protected open fun onPicked(
        request: Int,
        image: Uri,
    ) {
        if (request == OUTFIT) inBackground({ decode(image) }, ::wear)
    }

    @Deprecated("the platform's way without androidx")
    override fun onActivityResult(
        request: Int,
        result: Int,
        data: Intent?,
    ) {
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
        const val TRY_ON = "Try on"
        const val BODY_PARTS = "Body parts"
        const val OUTFIT = 2
        const val MAX_SIDE_PX = 2048
    }
}
