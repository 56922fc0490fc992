/* Images that the library renders: of heads (head.h) and of scenes (scene.h).
 *
 *   maq_head_renderer_run(renderer, &camera, &image);     or maq_scene_renderer_run
 *   maq_image_get_plane(image, MAQ_IMAGE_PLANE_DEPTH, &pixels, &stride_bytes);
 *   maq_image_save(image, "view.png", MAQ_IMAGE_ALPHA_ON);
 *   maq_image_release(image);
 *
 * Pixels of colour are three bytes in the order blue, green, red, as in MAQ_PIXEL_BGR8. Single colours of the API, such
 * as a background, are red, green, blue.
 */
#ifndef MAQUETTE_IMAGE_H_
#define MAQUETTE_IMAGE_H_

#include "maquette/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_image maq_image;

/* The planes of an image. Each has the size of the image. Values never change meaning; new ones are added at the end.
 */
typedef enum maq_image_plane {
  MAQ_IMAGE_PLANE_BGR = 1,     /* three bytes a pixel: blue, green, red */
  MAQ_IMAGE_PLANE_ALPHA = 2,   /* one byte a pixel: coverage, 0 (nothing there) to 255 */
  MAQ_IMAGE_PLANE_DEPTH = 3,   /* a float a pixel: depth along the optical axis, in metres for heads and in units of the
                                  scene for scenes; 0 where nothing is */
  MAQ_IMAGE_PLANE_NORMALS = 4, /* heads only. Three floats a pixel: the outward normal in the camera (x right, y down,
                                  z forward), of length 1; 0 where no head is. */
  MAQ_IMAGE_PLANE_TEMPLATE_POINTS = 5 /* heads only. Three floats a pixel: the corresponding point of the template
                                         head, in metres; 0 where no head is. */
} maq_image_plane;

/* Whether a file gets the alpha plane. */
typedef enum maq_image_alpha {
  MAQ_IMAGE_ALPHA_OFF = 0, /* colours alone */
  MAQ_IMAGE_ALPHA_ON = 1   /* PNG only: transparent where nothing is */
} maq_image_alpha;

/* Gets the size in pixels.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_image_get_size(const maq_image* image, int32_t* width_px, int32_t* height_px);

/* Gets a plane: rows of `*stride_bytes` bytes. The pixels are the image's and stay until it is released.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (also: the image has no such plane). Does not block. */
MAQ_API maq_status maq_image_get_plane(const maq_image* image, maq_image_plane plane, const void** pixels,
                                       size_t* stride_bytes);

/* Writes the colours to a file. The extension of `path` chooses the format: PNG (.png), lossless, or JPEG (.jpg, .jpeg)
 * at quality 95. The file appears atomically and replaces an existing file; its folder must exist.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another extension, alpha in a JPEG file), MAQ_ERROR_UNWRITABLE.
 * Blocks while the file is written. */
MAQ_API maq_status maq_image_save(const maq_image* image, const char* path, maq_image_alpha alpha);

/* Gives the image back to the pool of its renderer (NULL is fine). Pointers into it are invalid afterwards.
 * Once for each image, from any thread. Does not block. */
MAQ_API void maq_image_release(maq_image* image);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_IMAGE_H_ */
