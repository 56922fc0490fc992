package dev.maquette

import dev.maquette.jni.*

/**
 * A pixel that shows a point of the body surface.
 *
 * @property xPx in pixels of the frame; 0.5 is the middle of the first one.
 * @property distance how far the pixel's point is from the wanted point, in U and V; 0.02 or less is near.
 */
data class SurfacePixel(val xPx: Float, val yPx: Float, val distance: Float)

/**
 * The colours of one person on the body surface, from many frames. Made by [Maquette.densePoseTexture]. One call at a time.
 *
 * The image has a square tile for each of the 24 parts, in 4 columns of 6. The tile of part p is in column (p - 1) / 6 and
 * row (p - 1) % 6. In a tile, U grows to the right and V upwards.
 */
class DensePoseTexture internal constructor(pointer: Long) : AutoCloseable {
    internal val handle = Handle(this, pointer, Native::maq_densepose_texture_destroy)

    val widthPx: Int
    val heightPx: Int

    init {
        val (width, height) =
            handle.use { pairOf { width, height -> Native.maq_densepose_texture_get_size(it, width, height) } }
        widthPx = width
        heightPx = height
    }

    /**
     * Adds what a frame shows of a person. Choose the person with the same id in each frame.
     *
     * @param person index in [DensePoseResult.people].
     * @param frame the one that the result is of.
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another index, a frame of another size) and
     *   [Status.UNSUPPORTED] (a depth image).
     */
    fun addPerson(result: DensePoseResult, person: Int, frame: Frame) =
        handle.use { texture ->
            result.handle.use { people ->
                frame.handle.use { Native.maq_densepose_texture_add_person(texture, people, person, it) }
            }
        }

    /**
     * Copies the image, [heightPx] rows of [widthPx] pixels: R, G, B, A. A is the confidence of the colour, 0 where no frame
     * showed the surface; such pixels have the colours of the surface around them.
     */
    fun copyRgba(): ByteArray {
        val rgba = Memory(4 * widthPx * heightPx)
        handle.use { Native.maq_densepose_texture_draw(it, rgba, 0, rgba.sizeBytes.toLong()) }
        return rgba.bytes(0, rgba.sizeBytes)
    }

    /**
     * Writes the image to a .png file, atomically. Needs Android 11. Blocks while the file is written.
     *
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (another extension), [Status.UNSUPPORTED] (an older Android)
     *   and [Status.UNWRITABLE].
     */
    fun save(path: String) = handle.use { Native.maq_densepose_texture_save(it, textOf(path)) }

    override fun close() = handle.close()
}
