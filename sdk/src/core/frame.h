// A frame and the view of its pixels that the rest of the library works on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "maquette/frame.h"

namespace maq {

struct PlaneView {
  const uint8_t* data = nullptr;
  size_t stride_bytes = 0;
};

// Pixels that somebody else owns.
struct ImageView {
  maq_pixel_format format = MAQ_PIXEL_BGR8;
  int width_px = 0;
  int height_px = 0;
  PlaneView planes[2];
};

struct Frame {
  ImageView image;
  int64_t timestamp_ns = 0;
  maq_clock clock = MAQ_CLOCK_MEDIA;
  uint64_t sequence = 0;
  // Memory of the pixels when the library owns them; kept between uses of a pooled frame.
  std::vector<uint8_t> storage;

  // Makes `storage` hold one BGR image of that size without row padding and points `image` at it.
  uint8_t* allocate_bgr(int width_px, int height_px);
};

const char* pixel_format_name(maq_pixel_format format);
int plane_count(maq_pixel_format format);
// Bytes of pixels in a row of plane `plane`, without padding.
size_t row_bytes(maq_pixel_format format, int plane, int width_px);
int plane_rows(maq_pixel_format format, int plane, int height_px);

// Throws MAQ_ERROR_IMAGE_SIZE unless 1 <= side <= MAQ_MAX_SIDE_PX and the area is at most MAQ_MAX_PIXELS.
// `what` begins the sentence: "photo.jpg" or "The frame".
void check_image_size(int64_t width_px, int64_t height_px, const std::string& what);

// Throws when the description is not one of a readable image; fills in strides that are 0.
ImageView checked_image_view(const maq_frame_desc& desc);

}  // namespace maq
