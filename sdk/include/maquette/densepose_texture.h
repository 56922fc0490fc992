/* Textures of people: the colours of a person on the body surface, from many frames. */
#ifndef MAQUETTE_DENSEPOSE_TEXTURE_H_
#define MAQUETTE_DENSEPOSE_TEXTURE_H_

#include "maquette/densepose.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_densepose_texture maq_densepose_texture;

typedef struct maq_densepose_texture_config {
  uint32_t struct_size;
  int32_t tile_px; /* width and height of the tile of a part, 8 to 512; 0 (default): 64 */
} maq_densepose_texture_config;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_densepose_texture_config) of the
 * caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_texture_config_init(maq_densepose_texture_config* config, uint32_t struct_size);

/* Creates an empty texture for one person. `config` may be NULL for the defaults. Free `*texture` with
 * maq_densepose_texture_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_texture_create(maq_context* context, const maq_densepose_texture_config* config,
                                                maq_densepose_texture** texture);

/* Frees the texture (NULL is fine). Once for each handle, from any thread. Does not block. */
MAQ_API void maq_densepose_texture_destroy(maq_densepose_texture* texture);

/* Adds what a frame shows of a person. `frame` is the frame of the result. `index` is the person's, from 0; choose the
 * person with the same id in each frame. Pixels at the outline of the person are left out. Older frames count less.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range, a frame of another size),
 * MAQ_ERROR_UNSUPPORTED (a depth image). Does not block. */
MAQ_API maq_status maq_densepose_texture_add_person(maq_densepose_texture* texture, const maq_densepose_result* result,
                                                    uint32_t index, const maq_frame* frame);

/* Gets the size of the image: 4 tiles wide and 6 tiles high. Neither pointer may be NULL.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_texture_get_size(const maq_densepose_texture* texture, int32_t* width_px,
                                                  int32_t* height_px);

/* Draws the texture into memory of the app: 4 bytes a pixel (R, G, B, A), in rows of `stride_bytes` bytes (0: rows
 * without padding). `rgba` has `size_bytes` bytes. The tile of part p is in column (p - 1) / 6 and row (p - 1) % 6. In
 * a tile, U grows to the right and V upwards. A is the confidence of the colour: 0 where no frame showed the surface,
 * 128 after two pixels, up to 255. Where A is 0, the colour is taken from the surface around.
 *
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (too little memory). Does not block. */
MAQ_API maq_status maq_densepose_texture_draw(maq_densepose_texture* texture, uint8_t* rgba, size_t stride_bytes,
                                              size_t size_bytes);

/* Writes the image of maq_densepose_texture_draw to a .png file, atomically.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (another extension), MAQ_ERROR_UNWRITABLE. Blocks while it
 * writes. */
MAQ_API maq_status maq_densepose_texture_save(maq_densepose_texture* texture, const char* path);

/* Finds the pixel of a person that shows a point of the body surface. `index`: the person's, from 0. `part`: 1 to 24.
 * `u` and `v`: 0 to 1. `pixel_px` gets x and y in pixels of the frame, where (0.5, 0.5) is the middle of the first
 * pixel. `distance` gets how far the pixel's point is from the wanted point, in U and V; 0.02 or less is near.
 * `distance` may be NULL. The other direction, from a pixel to a point of the surface, is in the planes of the result.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND (no pixel shows the part). Does not block. */
MAQ_API maq_status maq_densepose_result_find_pixel(const maq_densepose_result* result, uint32_t index, int32_t part,
                                                   float u, float v, float pixel_px[2], float* distance);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_DENSEPOSE_TEXTURE_H_ */
