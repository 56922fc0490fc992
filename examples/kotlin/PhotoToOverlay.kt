package dev.maquette.examples

import android.graphics.Bitmap
import dev.maquette.DensePose
import dev.maquette.Maquette
import dev.maquette.ModelBundle

/** Draws the people of a photo over it, each pixel in the colour of its body part. Takes a while: not on the main thread. */
fun photoToOverlay(photo: Bitmap, networks: ModelBundle): Bitmap =
    Maquette().use { maquette ->
        val config = DensePose.Config(preset = DensePose.Preset.PHOTO)
        maquette.densePose(networks, config).use { people ->
            maquette.frame(photo).use { frame ->
                people.run(frame).use { result ->
                    photo.copy(Bitmap.Config.ARGB_8888, true).also { result.draw(it, frame) }
                }
            }
        }
    }
