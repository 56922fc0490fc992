package dev.maquette

import android.graphics.SurfaceTexture
import android.os.Looper
import android.view.Surface
import android.view.SurfaceHolder
import java.lang.reflect.Proxy
import org.robolectric.Shadows.shadowOf

/** Creates and ends the surface of a view, as Android does; Robolectric has none. */
class FakeSurface(private val view: LiveView) {
    private val surface = Surface(SurfaceTexture(1))
    private val holder =
        Proxy.newProxyInstance(javaClass.classLoader, arrayOf(SurfaceHolder::class.java)) { _, method, _ ->
            check(method.name == "getSurface") { "SurfaceHolder.${method.name} is not expected." }
            surface
        } as SurfaceHolder

    fun appear(widthPx: Int, heightPx: Int) {
        view.surfaceCreated(holder)
        resize(widthPx, heightPx)
    }

    fun resize(widthPx: Int, heightPx: Int) = view.surfaceChanged(holder, 1, widthPx, heightPx)

    fun vanish() {
        view.surfaceDestroyed(holder)
        FakeAndroid.takeAway(surface)
    }

    /** The picture that the surface shows, once it is as wanted. */
    fun picture(isWanted: (FakeAndroid.Picture) -> Boolean = { true }): FakeAndroid.Picture {
        val end = System.nanoTime() + 60_000_000_000
        while (System.nanoTime() < end) {
            shadowOf(Looper.getMainLooper()).idle()
            FakeAndroid.shown(surface)?.takeIf(isWanted)?.let { return it }
            Thread.sleep(10)
        }
        throw AssertionError("The surface does not show what is wanted within a minute.")
    }
}

/** Returns the threads that draw. */
fun threadsOfView(): List<Thread> = Thread.getAllStackTraces().keys.filter { it.name == "maquette-view" && it.isAlive }
