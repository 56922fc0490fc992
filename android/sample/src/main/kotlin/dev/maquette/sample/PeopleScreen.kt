package dev.maquette.sample

import android.graphics.Bitmap
import android.graphics.BitmapFactory
import android.graphics.Canvas
import android.net.Uri
import android.widget.Button
import dev.maquette.BodySurface
import dev.maquette.DensePoseResult

/** A screen of people, painted by body part or dressed. */
abstract class PeopleScreen : PictureScreen() {
    /** The image that people wear; null: they are painted by body part. */
    @Volatile
    private var worn: Bitmap? = null

    /** The outfit with the image that it was made of. The painting thread alone uses it. */
    private var outfit: Pair<Bitmap, Outfit>? = null
    private lateinit var mode: Button

    protected fun addModeButtons() {
        mode =
            button(TRY_ON) {
                if (worn != null) wear(null) else inBackground({ defaultOutfit() }, ::wear)
            }
        button("Wear a picture") { pickImage(OUTFIT) }
    }

    /** Is called after the outfit has changed. */
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
    protected fun paint(picture: Bitmap, people: DensePoseResult, surface: () -> BodySurface?): String {
        val wears = worn
        if (wears == null) {
            Canvas(picture).drawBitmap(people.overlay(), 0f, 0f, null)
            return "painted by body part"
        }
        val made = outfit?.takeIf { it.first === wears } ?: (wears to Outfit(wears, surface())).also { outfit = it }
        made.second.dress(picture, people)
        return "dressed by a picture"
    }

    override fun onPicked(request: Int, image: Uri) {
        if (request == OUTFIT) inBackground({ decode(image) }, ::wear)
    }

    private companion object {
        const val TRY_ON = "Try on"
        const val BODY_PARTS = "Body parts"
        const val OUTFIT = 2
    }
}
