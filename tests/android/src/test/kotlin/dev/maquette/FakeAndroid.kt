package dev.maquette

import android.hardware.HardwareBuffer
import android.view.Surface
import java.io.File
import java.nio.ByteBuffer

/** The native side of hardware buffers, surfaces and bitmaps in these tests (fake_android.cpp). */
object FakeAndroid {
    init {
        val root = File(System.getProperty("maquette.root")!!)
        System.load(File(root, "build/release/tests/android/fakes/libandroid.so").canonicalPath)
    }

    /** Rows of the buffer's width + 8 pixels. */
    @JvmStatic external fun memoryOf(buffer: HardwareBuffer): ByteBuffer

    @JvmStatic private external fun shownOn(surface: Surface): IntArray

    /** Ends a [Surface]: using it from now on is a mistake. */
    @JvmStatic external fun takeAway(surface: Surface)

    /** Mistakes that would end an app, and what is kept or locked still. */
    @JvmStatic external fun misuse(): String

    class Picture(val widthPx: Int, val heightPx: Int, val posts: Int, private val pixels: List<Int>) {
        /** 0xRRGGBB. */
        fun colour(x: Int, y: Int): Int {
            val pixel = pixels[y * widthPx + x]
            return pixel and 0xFF shl 16 or (pixel and 0xFF00) or (pixel shr 16 and 0xFF)
        }

        val colours get() = pixels.toSet().size
    }

    /** The picture that the surface shows; null before the first. */
    fun shown(surface: Surface): Picture? {
        val all = shownOn(surface)
        return Picture(all[0], all[1], all[2], all.drop(3)).takeIf { it.posts > 0 }
    }
}
