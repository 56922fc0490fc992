/* Dense clouds from posed photos and a sparse cloud: the depth of each photo is computed, and the depth images are
 * fused (docs/guide/scene.md).
 *
 *   maq_dense_cloud_create(context, NULL, photos, photo_count, &sparse, &dense);
 *   maq_dense_cloud_get_points(dense, &points, &rgb);
 *   maq_scene_builder_create(context, NULL, &points, &builder);
 *
 * maq_scene_build does the same by itself for a capture with a sparse cloud. Lengths are in the unit of the cloud and
 * the cameras. No network is used. */
#ifndef MAQUETTE_DENSE_CLOUD_H_
#define MAQUETTE_DENSE_CLOUD_H_

#include "maquette/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_dense_cloud maq_dense_cloud;

/* A photo with its camera. The frames stay the app's and are only used during the call. */
typedef struct maq_posed_photo {
  uint32_t struct_size;
  const maq_frame* photo;    /* any pixel format but depth. Larger ones are scaled down to a long side of 960 pixels. */
  const maq_frame* mask;     /* an image of the photo's size; no point is made of pixels where it is black. May be
                                NULL: all pixels are used. */
  maq_pinhole_camera camera; /* of the photo; may have distortion */
} maq_posed_photo;

/* All zero is the default. */
typedef struct maq_dense_cloud_config {
  uint32_t struct_size;
  int32_t threads;     /* 1 to 64. 0: the large cores, at most 4. The result is the same for any number. */
  uint64_t max_points; /* if there are more points, a random selection is kept. 0: 1.5 million */
  maq_progress_callback progress_callback; /* of maq_dense_cloud_create; may be NULL */
  void* progress_user_data;                /* passed to progress_callback */
} maq_dense_cloud_config;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_dense_cloud_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_dense_cloud_config_init(maq_dense_cloud_config* config, uint32_t struct_size);

/* Computes a dense cloud. `photos` has `photo_count` entries, 1 to 100,000, each with its struct_size. `sparse` has
 * points of the scene, such as an AR session or COLMAP finds. A photo without 12 of them in its image has no depth.
 * Neither has a photo if no other photo sees these points from elsewhere. `up` of `sparse` is only copied.
 * `config` may be NULL for the defaults. Takes some 256 bytes for each pixel of one photo, and 6 for each pixel of all
 * photos. The caller owns `*cloud`; give it to maq_dense_cloud_destroy. On failure and when cancelled `*cloud` stays
 * unchanged.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (an invalid camera, another size than the photo's or the mask's, no
 * points, a point that is not finite). MAQ_ERROR_UNSUPPORTED (a depth image, over 30 million points).
 * MAQ_ERROR_NOT_FOUND (no photo has depth). MAQ_ERROR_OUT_OF_MEMORY. MAQ_CANCELLED (by the progress callback). Blocks
 * until the cloud is computed: about 1 s a photo of 960 x 540 on two cores. */
MAQ_API maq_status maq_dense_cloud_create(maq_context* context, const maq_dense_cloud_config* config,
                                          const maq_posed_photo* photos, uint32_t photo_count,
                                          const maq_point_cloud* sparse, maq_dense_cloud** cloud);

/* Frees the cloud (NULL is fine). Frames of maq_dense_cloud_load_depth stay valid.
 * Once for each cloud, from any thread. Does not block. */
MAQ_API void maq_dense_cloud_destroy(maq_dense_cloud* cloud);

/* Gets the points, ready for maq_scene_builder_create, with the origin and the up vector of the sparse cloud, and their
 * colours, [point_count][3], red first. `rgb` may be NULL. The arrays are the cloud's. The caller sets
 * points->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_dense_cloud_get_points(const maq_dense_cloud* cloud, maq_point_cloud* points,
                                              const uint8_t** rgb);

/* Copies the depth of the photo at `index`, below photo_count: a frame MAQ_PIXEL_DEPTH32F along the optical axis, 0
 * where depth is unknown. `*camera` gets the pose of the photo and the size of the depth image, without distortion. The
 * caller sets camera->struct_size. The caller owns `*frame`; give it to maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Blocks while it copies. */
MAQ_API maq_status maq_dense_cloud_load_depth(const maq_dense_cloud* cloud, uint32_t index, maq_pinhole_camera* camera,
                                              maq_frame** frame);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_DENSE_CLOUD_H_ */
