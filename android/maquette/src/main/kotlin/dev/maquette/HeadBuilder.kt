package dev.maquette

import dev.maquette.jni.*

/** Receives the head as far as it is fitted, on the thread that fits, which waits meanwhile. */
fun interface HeadPreview {
    /** @param head the preview's, to be closed by it. */
    fun onPreview(head: Head)
}

/** The box of a head with its hair, in pixels of the photo; right and bottom are exclusive. */
data class HeadBox(val left: Float, val top: Float, val right: Float, val bottom: Float)

/**
 * Makes a head from photos of one person. Made by [Maquette.headBuilder].
 *
 * ```
 * builder.addPhoto(frame)
 * builder.fit(3.0) { done, _ -> show(done); isActive }.use { head -> head.mesh().use { it.save(path) } }
 * ```
 *
 * A face is biometric data: ask the person, and protect heads like passwords. The part of each photo around the
 * head stays in memory until [clear] or [close].
 *
 * Functions may be called from any thread, one at a time but for [cancel]; they take long, so not on the main thread.
 */
class HeadBuilder internal constructor(pointer: Long) : AutoCloseable {
    private val handle = Handle(this, pointer, Native::maq_head_builder_destroy)

    /** Whether heads get a texture. */
    enum class Texture(internal val code: Int) {
        /** The SDK's choice: [ON] in this version. */
        DEFAULT(MAQ_HEAD_TEXTURE_DEFAULT),

        /** Heads have colours of the network alone, and hold no part of a photo. */
        OFF(MAQ_HEAD_TEXTURE_OFF),

        /** The photos' pixels where they see the surface well, the network's colours elsewhere. */
        ON(MAQ_HEAD_TEXTURE_ON),
    }

    /**
     * @property threads as of [DensePose.Config], for the network and the fit.
     * @property provider as of [DensePose.Config].
     * @property texture with 1024 pixels a fit takes 140 MB of memory more.
     * @property texturePx pixels a side, 256 to 2048; 0: 1024. Not with [Texture.OFF].
     * @property delightTexture directional light of the photos is removed from the texture, as far as the colours tell it,
     *   so that an app can relight the head.
     */
    data class Config(
        val threads: Int = 0,
        val provider: DensePose.Provider = DensePose.Provider.CPU,
        val texture: Texture = Texture.DEFAULT,
        val texturePx: Int = 0,
        val delightTexture: Boolean = false,
    ) {
        internal fun native(bundle: ModelBundle) =
            maq_head_builder_config().also {
                it.model.set(bundle, threads, provider)
                it.texture = texture.code
                it.texture_px = texturePx
                it.delight_texture = delightTexture.toInt()
                it.progress_callback = Addresses.ofProgressCallback()
            }
    }

    /**
     * The head that was found in a photo. The last three describe the latest [fit], and are false or 0 before.
     *
     * @property box of the head: given, or detected.
     * @property headCoverage fraction of the encoder's crop that shows the head, 0 to 1.
     * @property isUsed whether the head was fitted to it. Photos without a head or of a different person are rejected.
     * @property focalPx of the camera, given or estimated, in pixels of the photo.
     * @property rmsPx root mean square distance of head points from where the network saw them.
     */
    data class Photo(
        val box: HeadBox,
        val headCoverage: Float,
        val isUsed: Boolean,
        val focalPx: Float,
        val rmsPx: Float,
    )

    /**
     * Wall-clock milliseconds, and counts, of the photos so far and of the latest [fit].
     *
     * @property encodeMs the network, over all photos.
     * @property poseMs cameras and a first shape, from the network's output.
     * @property fitMs the fit of the head to the pixels, in [steps].
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

    /** The head of each photo, in the order of [addPhoto]. */
    val photos: List<Photo>
        get() =
            List(nativeStats().photo_count) { index ->
                val p = maq_head_photo_info()
                handle.use { Native.maq_head_builder_get_photo(it, index, p) }
                val (left, top, right, bottom) = p.box_px
                Photo(HeadBox(left, top, right, bottom), p.head_coverage, p.is_used != 0, p.focal_px, p.rms_px)
            }

    /** As it is now. */
    val stats: Stats
        get() {
            val s = nativeStats()
            return Stats(
                s.photo_count, s.used_photo_count, s.encode_ms, s.pose_ms, s.fit_ms, s.total_ms, s.step_count,
                DensePose.Provider.of(s.provider), s.threads,
            )
        }

    private fun nativeStats() = handle.read(maq_head_build_stats(), Native::maq_head_builder_get_stats)

    /**
     * Encodes a photo of the head, of any format but depth, which may be closed afterwards. Several must be of one
     * person; each may have its own camera, without lens distortion. When it fails, the builder stays as it was.
     *
     * @param box of the head, which may reach beyond the photo ([DensePoseResult.headBox]); null: it is looked for, which
     *   takes longer, and finds it where it is alone in the photo and not small.
     * @param rollRad rotation of the head in the photo's plane, clockwise from upright; exact to some 30 degrees is enough.
     * @param focalPx of the camera, in pixels of this photo; null: it is estimated.
     * @throws MaquetteException with [Status.NOT_FOUND] (there is no head), [Status.INVALID_ARGUMENT] (a box that is
     *   empty or outside of the photo, a focal length that is not positive, more than 64 photos), [Status.UNSUPPORTED] (a
     *   depth image), [Status.CANCELLED] after [cancel].
     */
    fun addPhoto(photo: Frame, box: HeadBox? = null, rollRad: Float = 0f, focalPx: Float? = null) {
        // For the C API zeros mean unknown.
        require(box != HeadBox(0f, 0f, 0f, 0f)) { "The box is empty; give the head's, or null to detect it." }
        require(focalPx != 0f) { "The focal length is 0; give the camera's, or null to have it estimated." }
        val (left, top, right, bottom) = box ?: HeadBox(0f, 0f, 0f, 0f)
        val known =
            maq_head_photo().also {
                it.box_px = listOf(left, top, right, bottom)
                it.roll_rad = rollRad
                it.focal_px = focalPx ?: 0f
            }
        handle.use { builder -> photo.handle.use { Native.maq_head_builder_add_photo(builder, it, known) } }
    }

    /**
     * Uses [head] as prior for later fits, so that its photos are not needed again. It must show the same person; another
     * call replaces it. Its cameras come first in the fitted head, and a known size stays.
     *
     * @throws MaquetteException with [Status.UNSUPPORTED] (a head of another bundle, or from a file of version 1),
     *   [Status.INVALID_ARGUMENT] (more than 192 photos).
     */
    fun addHead(head: Head) = handle.use { builder -> head.handle.use { Native.maq_head_builder_add_head(builder, it) } }

    /** Forgets the photos and the prior head, so that another person's head can be fitted. */
    fun clear() = handle.use(Native::maq_head_builder_clear)

    /**
     * Fits one head to the photos so far. The first stage finds cameras and a shape in milliseconds; with [seconds] 0 that
     * is the result. The second stage fits shape and colours to the pixels, for up to [seconds] or until it converges. More
     * photos may be added afterwards and all be fitted again.
     *
     * @param preview receives the head so far, first the network's head, then every [previewIntervalS] seconds; not with
     *   [seconds] 0. Its exceptions cancel, and are thrown. It must not use this builder, except [cancel].
     * @param progress may cancel; its exceptions cancel too, and are thrown. It must not use this builder, except [cancel].
     * @throws MaquetteException with [Status.INVALID_ARGUMENT] (no photos, times out of 0 to 3600),
     *   [Status.NOT_FOUND] (no photo shows a head), [Status.CANCELLED].
     */
    fun fit(
        seconds: Double = 3.0,
        previewIntervalS: Double = 1.0,
        preview: HeadPreview? = null,
        progress: Progress? = null,
    ): Head =
        handle.use { builder ->
            Callbacks.during(progress, preview, discard = Head::close) {
                if (preview == null) {
                    Native.maq_head_builder_set_preview(builder, 0.0, 0, 0)
                } else {
                    Native.maq_head_builder_set_preview(builder, previewIntervalS, Addresses.ofPreviewCallback(), 0)
                }
                Head(Native.maq_head_builder_fit(builder, seconds))
            }
        }

    /** Ends the running [addPhoto] or [fit], or else the next one; from any thread. Does not block. */
    fun cancel() = handle.use(Native::maq_head_builder_cancel)

    /** Its heads stay valid. */
    override fun close() = handle.close()
}
