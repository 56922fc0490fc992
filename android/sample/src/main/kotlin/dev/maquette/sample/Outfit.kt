package dev.maquette.sample

import android.graphics.Bitmap
import dev.maquette.BodySurface
import dev.maquette.DensePoseResult
import kotlin.math.floor

/**
 * An outfit: a colour for each point of the body. As in the desktop demo, an image of 2 : 3 is an atlas of 4 x 6
 * charts in the DensePose layout; any other image is repeated over the body's front and back.
 *
 * @param surface of the networks that find the people; an atlas needs none.
 * @throws IllegalArgumentException for another picture without a surface.
 */
class Outfit(picture: Bitmap, surface: BodySurface?) {
    /** [part - 1][U][V], each of 256 levels as in the planes of a result: one look-up a pixel. */
    private val colours = IntArray(PARTS shl 16)
    private val width = picture.width
    private val height = picture.height
    private val texels = IntArray(width * height).also { picture.getPixels(it, 0, width, 0, 0, width, height) }

    init {
        if (width * 3 == height * 2) {
            fillFromAtlas()
        } else {
            requireNotNull(surface) { "These networks have no body surface: wear an atlas of 4 x 6 charts, 2 : 3." }
            fillAround(surface)
        }
    }

    /** Dresses the people of a picture, in place. [people] are its own; U and V are needed. */
    fun dress(picture: Bitmap, people: DensePoseResult) {
        val parts = people.copyPlane(DensePoseResult.Plane.PART)
        val u = people.copyPlane(DensePoseResult.Plane.U)
        val v = people.copyPlane(DensePoseResult.Plane.V)
        val pixels = IntArray(parts.size)
        picture.getPixels(pixels, 0, people.widthPx, 0, 0, people.widthPx, people.heightPx)
        for (i in parts.indices) {
            val part = parts[i].toInt()
            if (part == 0) continue
            val worn = colours[part - 1 shl 16 or (u[i].toInt() and 0xFF shl 8) or (v[i].toInt() and 0xFF)]
            val seen = pixels[i]
            val luma = (77 * (seen shr 16 and 0xFF) + 150 * (seen shr 8 and 0xFF) + 29 * (seen and 0xFF)) shr 8
            // Folds and shadows of what people really wear show through: 0.65 to 1.25, of 256.
            val light = 166 + (154 * luma shr 8)
            val red = minOf(255, (worn shr 16 and 0xFF) * light shr 8)
            val green = minOf(255, (worn shr 8 and 0xFF) * light shr 8)
            val blue = minOf(255, (worn and 0xFF) * light shr 8)
            pixels[i] = 0xFF shl 24 or (red shl 16) or (green shl 8) or blue
        }
        picture.setPixels(pixels, 0, people.widthPx, 0, 0, people.widthPx, people.heightPx)
    }

    private fun fillFromAtlas() {
        val (tileWidth, tileHeight) = width / 4f to height / 6f
        for (part in 0 until PARTS) {
            val (left, top) = part / 6 * tileWidth to part % 6 * tileHeight
            for (u in 0..255) for (v in 0..255) {
                // Tiles do not bleed into each other: half a texel stays between.
                val x = (u / 255f * tileWidth).coerceIn(0.5f, tileWidth - 0.5f)
                val y = ((1 - v / 255f) * tileHeight).coerceIn(0.5f, tileHeight - 0.5f)
                colours[part shl 16 or (u shl 8) or v] = texel(left + x, top + y)
            }
        }
    }

    private fun fillAround(surface: BodySurface) {
        val points = withoutHoles(surface)
        val last = surface.nodes - 1
        val point = FloatArray(3)
        for (part in 0 until PARTS) for (u in 0..255) for (v in 0..255) {
            val (atU, atV) = u * last / 255f to v * last / 255f
            val (u0, v0) = minOf(atU.toInt(), last - 1) to minOf(atV.toInt(), last - 1)
            val first = 3 * ((part * surface.nodes + u0) * surface.nodes + v0)
            for (axis in 0..2) {
                val at = first + axis
                val next = at + 3 * surface.nodes
                val before = points[at] + (atV - v0) * (points[at + 3] - points[at])
                val after = points[next] + (atV - v0) * (points[next + 3] - points[next])
                point[axis] = before + (atU - u0) * (after - before)
            }
            // The picture's width is that of a body, 45 cm, from its middle; its top is at the neck, 1.45 m.
            val across = 0.5f + (if (point[1] < 0) point[0] else -point[0]) / WIDTH_M
            val down = (TOP_M - point[2]) / WIDTH_M * width / height
            colours[part shl 16 or (u shl 8) or v] = texel(across * width, down * height)
        }
    }

    /** The points; outside of a chart its nearest one is repeated, so that U and V between two nodes have one. */
    private fun withoutHoles(surface: BodySurface): FloatArray {
        val points = surface.copyPoints()
        val filled = points.clone()
        val nodes = surface.nodes
        for (part in 0 until PARTS) for (u in 0 until nodes) for (v in 0 until nodes) {
            val at = 3 * ((part * nodes + u) * nodes + v)
            if (!points[at].isNaN()) continue
            var least = Int.MAX_VALUE
            for (otherU in 0 until nodes) for (otherV in 0 until nodes) {
                val from = 3 * ((part * nodes + otherU) * nodes + otherV)
                val away = (otherU - u) * (otherU - u) + (otherV - v) * (otherV - v)
                if (away >= least || points[from].isNaN()) continue
                least = away
                points.copyInto(filled, at, from, from + 3)
            }
        }
        return filled
    }

    /** Bilinear; (0.5, 0.5) is the first texel's centre, and the picture repeats itself. */
    private fun texel(x: Float, y: Float): Int {
        val (x0, y0) = floor(x - 0.5f) to floor(y - 0.5f)
        val (right, bottom) = ((x - 0.5f - x0) * 256).toInt() to ((y - 0.5f - y0) * 256).toInt()
        var (red, green, blue) = Triple(0, 0, 0)
        for (corner in 0..3) {
            val column = (x0.toInt() + (corner and 1)).mod(width)
            val row = (y0.toInt() + (corner shr 1)).mod(height)
            val across = if (corner and 1 == 1) right else 256 - right
            val weight = across * (if (corner shr 1 == 1) bottom else 256 - bottom)
            val texel = texels[row * width + column]
            red += weight * (texel shr 16 and 0xFF)
            green += weight * (texel shr 8 and 0xFF)
            blue += weight * (texel and 0xFF)
        }
        return (red shr 16 shl 16) or (green shr 16 shl 8) or (blue shr 16)
    }

    private companion object {
        const val PARTS = 24
        const val WIDTH_M = 0.45f
        const val TOP_M = 1.45f
    }
}
