package dev.maquette

import dev.maquette.jni.NativeHead

/** Told how far a fit has come, on the thread that fits, which waits meanwhile. */
fun interface HeadProgress {
    /**
     * @param done the fraction that is done, 0 to 1.
     * @return false to cancel.
     */
    fun onProgress(done: Double): Boolean
}

/** Gets the head as far as it is fitted, on the thread that fits, which waits meanwhile. */
fun interface HeadPreview {
    /** @param head the preview's, to be closed by it. */
    fun onPreview(head: Head)
}

/** Called by native code, by its names. */
internal class HeadCallbacks(private val progress: HeadProgress?, private val preview: HeadPreview?) {
    @Suppress("unused")
    fun onProgress(done: Double): Boolean = progress?.onProgress(done) ?: true

    @Suppress("unused")
    fun onPreview(head: Long) {
        preview?.onPreview(Head(head))
    }
}

/** Where a head is, with its hair: edges in pixels of the photo, the right and the bottom one exclusive. */
data class HeadBox(val left: Float, val top: Float, val right: Float, val bottom: Float)

/**
 * Makes a head from photos of one person. Made by [Maquette.headBuilder].
 *
 * ```
 * builder.addPhoto(frame)
 * builder.fit(3.0) { done -> show(done); isActive }.use { head -> head.export(path) }
 * ```
 *
 * A face is biometric data: ask the person, and keep heads as you would keep passwords. The part of each photo around the
 * head stays in memory until [clear] or [close].
 *
 * Functions may be called from any thread, one at a time but for [cancel]; they take long, so not on the main thread.
 */
class HeadBuilder internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, NativeHead::destroyBuilder)

    /**
     * @property threads as of [DensePose.Config], for the network and the fit.
     * @property texturePx pixels a side of the texture that heads get, 256 to 2048: the photos' pixels where they see the
     *   surface well. With 1024 a fit takes 140 MB of memory more. 0: they have none, and hold no part of a photo.
     * @property isTextureMirrored what no photo sees of one side looks like the other.
     * @property allowSpinning as of [DensePose.Config].
     * @property provider as of [DensePose.Config].
     * @property isTextureUnlit the photos' light from one side is taken out of the texture, as far as it can be told from
     *   the colours, so that an app can light the head anew.
     */
    data class Config(
        val threads: Int = 0,
        val texturePx: Int = 0,
        val isTextureMirrored: Boolean = false,
        val allowSpinning: Boolean = false,
        val provider: DensePose.Provider = DensePose.Provider.CPU,
        val isTextureUnlit: Boolean = false,
    ) {
        internal fun values() =
            doubleArrayOf(
                threads.toDouble(),
                texturePx.toDouble(),
                if (isTextureMirrored) 1.0 else 0.0,
                if (allowSpinning) 1.0 else 0.0,
                provider.ordinal.toDouble(),
                if (isTextureUnlit) 1.0 else 0.0,
            )
    }

    /**
     * What was found of a photo. The last three are of the latest [fit], and false or 0 before.
     *
     * @property box in which the head was seen: given, or found.
     * @property headFraction how much of the box's surroundings the network sees as head, 0 to 1.
     * @property isUsed whether the head was fitted to it. A photo without a head, or with another one than the other
     *   photos, is left out.
     * @property focalPx of the camera, given or estimated, in pixels of the photo.
     * @property rmsPx root mean square distance of points of the head from where the network saw them.
     */
    data class Photo(
        val box: HeadBox,
        val headFraction: Float,
        val isUsed: Boolean,
        val focalPx: Float,
        val rmsPx: Float,
    )

    /**
     * Wall-clock milliseconds, and counts, of the photos so far and of the latest [fit].
     *
     * @property encodeMs the network, over all photos.
     * @property poseMs cameras and a first shape, from what the network saw.
     * @property fitMs the head fitted to the pixels, in [steps].
     * @property totalMs of the fit.
     */
    data class Stats(
        val photos: Int,
        val usedPhotos: Int,
        val encodeMs: Double,
        val poseMs: Double,
        val fitMs: Double,
        val totalMs: Double,
        val steps: Int,
        val provider: DensePose.Provider,
        val threads: Int,
    )

    /** What was found of each photo, in the order they were added. */
    val photos: List<Photo>
        get() =
            handle.use { builder ->
                List(NativeHead.builderStats(builder)[0].toInt()) { index ->
                    val p = NativeHead.photo(builder, index)
                    Photo(HeadBox(p[0], p[1], p[2], p[3]), p[4], p[5] != 0f, p[6], p[7])
                }
            }

    /** As it is now. */
    val stats: Stats
        get() {
            val s = handle.use(NativeHead::builderStats)
            return Stats(
                s[0].toInt(), s[1].toInt(), s[2], s[3], s[4], s[5], s[6].toInt(),
                DensePose.Provider.entries[s[7].toInt()], s[8].toInt(),
            )
        }

    /**
     * Looks at a photo of the head, of any format but depth, which may be closed afterwards. Several must be of one
     * person; each may have its own camera, without lens distortion. When it fails, the builder stays as it was.
     *
     * @param box of the head, which may reach beyond the photo ([DensePoseResult.headBox]); null: it is looked for, which
     *   takes longer, and finds it where it is alone in the photo and not small.
     * @param rollRad how far the head is turned in the photo's plane, clockwise from upright; it need be right to some
     *   30 degrees.
     * @param focalPx of the camera, in pixels of this photo; null: it is estimated.
     * @throws MaquetteException with [Status.NOT_FOUND] (there is no head), [Status.INVALID_ARGUMENT] (a box that is
     *   empty or outside of the photo, a focal length that is not positive, more than 64 photos), [Status.UNSUPPORTED] (a
     *   depth image), [Status.CANCELLED] after [cancel].
     */
    fun addPhoto(
        photo: Frame,
        box: HeadBox? = null,
        rollRad: Float = 0f,
        focalPx: Float? = null,
    ) {
        // To the C API zeros are what is not known.
        require(box != HeadBox(0f, 0f, 0f, 0f)) { "The box is empty; give the head's, or null to look for it." }
        require(focalPx != 0f) { "The focal length is 0; give the camera's, or null to have it estimated." }
        val (left, top, right, bottom) = box ?: HeadBox(0f, 0f, 0f, 0f)
        val hints = floatArrayOf(left, top, right, bottom, rollRad, focalPx ?: 0f)
        handle.use { builder -> photo.handle.use { NativeHead.addPhoto(builder, it, hints) } }
    }

    /**
     * Adds the photos of this builder to those that [head] was fitted to, which are not needed: later fits go on from what
     * they said. It must be of the same person; another takes its place. Its cameras come first in the head that is
     * fitted, and a size that was known stays.
     *
     * @throws MaquetteException with [Status.UNSUPPORTED] (a head of another bundle, or from a file of
     *   version 1), [Status.INVALID_ARGUMENT] (more than 192 photos).
     */
    fun addHead(head: Head) = handle.use { builder -> head.handle.use { NativeHead.addHead(builder, it) } }

    /** Forgets the photos, and the head that they would be added to, for a head of another person. */
    fun clear() = handle.use(NativeHead::clear)

    /**
     * Fits one head to the photos so far: cameras and a first shape in milliseconds, which is the head where [seconds] is
     * 0; then shape and colours to the pixels, for up to [seconds] or until that gains no more. More photos may be added
     * afterwards and all be fitted again.
     *
     * @param preview gets the head that the network saw, then, every [previewIntervalS] seconds, what there is of it;
     *   not where [seconds] is 0. What it throws cancels, and is thrown. It must not use this builder.
     * @param progress may cancel; what it throws cancels too, and is thrown. It must not use this builder, but for
     *   [cancel].
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (no photos, times out of 0 to 3600),
     *   [Status.NOT_FOUND] (no photo shows a head), [Status.CANCELLED].
     */
    fun fit(
        seconds: Double = 3.0,
        previewIntervalS: Double = 1.0,
        preview: HeadPreview? = null,
        progress: HeadProgress? = null,
    ): Head =
        handle.use { builder ->
            Head(
                NativeHead.fit(builder, seconds, HeadCallbacks(progress, preview), preview != null, previewIntervalS),
            )
        }

    /** Ends the [addPhoto] or [fit] that runs, or else the next; from any thread. Does not block. */
    fun cancel() = handle.use(NativeHead::cancel)

    /** Heads that it made stay valid. */
    override fun close() = handle.close()
}
