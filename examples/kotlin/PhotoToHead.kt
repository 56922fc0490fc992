package dev.maquette.examples

import android.graphics.Bitmap
import dev.maquette.Maquette
import dev.maquette.ModelBundle

/**
 * Writes the head of a person as a mesh (.glb), from one photo. A face is biometric data: ask the person.
 *
 * @param progress receives the fraction done; returning false cancels.
 */
fun photoToHead(photo: Bitmap, networks: ModelBundle, path: String, progress: (Double) -> Boolean) {
    Maquette().use { maquette ->
        maquette.headBuilder(networks).use { builder ->
            maquette.frame(photo).use { builder.addPhoto(it) }
            builder.fit(seconds = 3.0) { done, _ -> progress(done) }.use { head -> head.mesh().use { it.save(path) } }
        }
    }
}
