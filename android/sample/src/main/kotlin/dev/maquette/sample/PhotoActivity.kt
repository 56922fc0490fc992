package dev.maquette.sample

import android.graphics.Bitmap
import android.net.Uri
import android.os.Bundle
import dev.maquette.DensePose

/** The people of a photo that the user picks. */
open class PhotoActivity : PeopleScreen() {
    private val densePose by lazy {
        val config = DensePose.Config(preset = DensePose.Preset.PHOTO)
        maquette.densePose(networks("densepose-b-int8"), config)
    }
    private var photo: Bitmap? = null

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        say("Choose a photo. It stays on this device.")
        button("Choose a photo") { pickImage(PHOTO) }
        addModeButtons()
    }

    override fun onPicked(request: Int, image: Uri) {
        if (request != PHOTO) return super.onPicked(request, image)
        say("Opening …")
        inBackground({ decode(image) }) { bitmap ->
            photo = bitmap
            onModeChanged()
        }
    }

    override fun close() {
        densePose.close()
        super.close()
    }

    override fun onModeChanged() {
        val chosen = photo ?: return
        say("Looking for people …")
        inBackground({ process(chosen.copy(Bitmap.Config.ARGB_8888, true)) }) { (bitmap, description, sentence) ->
            show(bitmap, description)
            say(sentence)
        }
    }

    private fun process(photo: Bitmap): Triple<Bitmap, String, String> =
        maquette.frame(photo).use { frame ->
            densePose.run(frame).use { result ->
                val count = people(result.people.size)
                val how = paint(photo, result, densePose::surface)
                Triple(photo, "The photo, $count $how", "%s in %.0f ms".format(count, result.stats.totalMs))
            }
        }

    private companion object {
        const val PHOTO = 1
    }
}
