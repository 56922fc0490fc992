/* Captures: posed photos of an environment and a point cloud, read from a folder. Scenes (scene.h) are built from them.
 */
#ifndef MAQUETTE_CAPTURE_H_
#define MAQUETTE_CAPTURE_H_

#include "maquette/pinhole_camera.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_capture maq_capture;

typedef struct maq_capture_info {
  uint32_t struct_size;
  uint32_t view_count;
  uint64_t point_count;
  uint32_t drop_count; /* reasons why parts were dropped, see maq_capture_get_drop */
  double up[3];        /* of the world; unit vector */
} maq_capture_info;

/* A photo of the capture. The text is the capture's. */
typedef struct maq_capture_view {
  uint32_t struct_size;
  int32_t is_held_out;       /* 1: held out for comparison; maq_scene_build does not use it by default */
  const char* name;          /* of the photo in the capture */
  maq_pinhole_camera camera; /* of the photo after undistortion */
  int32_t has_depth;         /* 1: the view also has a depth image, see maq_capture_load_depth */
} maq_capture_view;

/* Parts of the capture that cannot be used. The text is the capture's. */
typedef struct maq_capture_drop {
  uint32_t struct_size;
  const char* reason; /* with the first example: "photos without a camera (first: images/7.jpg)" */
  uint64_t count;     /* of the parts */
} maq_capture_drop;

/* Opens a folder with a COLMAP model or a transforms.json. A COLMAP model is text or binary, in sparse/0, sparse,
 * colmap/sparse/0 or the folder itself. transforms.json is as written by nerfstudio and Instant-NGP, with a PLY cloud
 * or with depth images. Photos and depth are read when they are needed. The caller owns `*capture`; give it to
 * maq_capture_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. MAQ_ERROR_NOT_FOUND (no such folder, no capture in it, or neither
 * cloud nor depth). MAQ_ERROR_UNREADABLE (damaged, or no usable photo or point). MAQ_ERROR_UNSUPPORTED (camera models,
 * sizes). Blocks while cameras and cloud are read. */
MAQ_API maq_status maq_capture_open(maq_context* context, const char* folder, maq_capture** capture);

/* Frees the capture (NULL is fine). Scenes built from it and frames loaded from it stay valid.
 * Once for each capture, from any thread. Does not block. */
MAQ_API void maq_capture_destroy(maq_capture* capture);

/* Gets the counts and the up vector. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_capture_get_info(const maq_capture* capture, maq_capture_info* info);

/* Gets the view at `index`, below view_count. The caller sets view->struct_size; the library sets
 * view->camera.struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Does not block. */
MAQ_API maq_status maq_capture_get_view(const maq_capture* capture, uint32_t index, maq_capture_view* view);

/* Gets one reason why parts of the capture were dropped. `index` is below drop_count. The caller sets
 * drop->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Does not block. */
MAQ_API maq_status maq_capture_get_drop(const maq_capture* capture, uint32_t index, maq_capture_drop* drop);

/* Reads the photo of the view at `index`, below view_count, and undistorts it. The frame is MAQ_PIXEL_BGR8, in the size
 * of the view's camera. The caller owns `*frame`; give it to maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED,
 * MAQ_ERROR_IMAGE_SIZE. Blocks while the photo is read. */
MAQ_API maq_status maq_capture_load_view(const maq_capture* capture, uint32_t index, maq_frame** frame);

/* Reads the depth image of the view at `index`, below view_count, and its camera. MAQ_PIXEL_DEPTH32F is in units of the
 * scene. MAQ_PIXEL_DEPTH16 is in thousandths of that unit, which are millimetres if the unit is a metre. `*camera` gets
 * the pose of the photo and the size of the depth image. The caller sets camera->struct_size. The caller owns `*frame`;
 * give it to maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND (also: the view has no depth),
 * MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED (not a depth image, a lens with distortion), MAQ_ERROR_IMAGE_SIZE.
 * Blocks while the image is read. */
MAQ_API maq_status maq_capture_load_depth(const maq_capture* capture, uint32_t index, maq_pinhole_camera* camera,
                                          maq_frame** frame);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_CAPTURE_H_ */
