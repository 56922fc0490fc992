package dev.maquette.sample

import com.google.ar.core.ArCoreApk
import com.google.ar.core.exceptions.UnavailableException

/** Captures a place with ARCore, which is installed when it is missing and the device supports it. */
class ArCaptureActivity : CaptureActivity() {
    private var hasAsked = false

    /** Google asks every app with ARCore to say this. */
    override val notice get() =
        "Where the camera is comes from Google Play Services for AR (ARCore), which is provided by Google and " +
            "governed by the Google Privacy Policy."

    override fun isReady(): Boolean =
        try {
            // May show Google's own screen; this one resumes afterwards.
            val status = ArCoreApk.getInstance().requestInstall(this, !hasAsked)
            hasAsked = true
            status == ArCoreApk.InstallStatus.INSTALLED && super.isReady()
        } catch (error: UnavailableException) {
            say("This device has no ARCore (${error.javaClass.simpleName}): open a scene file in its place.")
            false
        }

    override fun openCamera(): PosedCamera = ArCoreCamera(this, maquette, windowManager.defaultDisplay.rotation * 90)
}
