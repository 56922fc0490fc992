// Image files to frames.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/frame.h"

namespace maq {

// Decodes an image file into `frame` as BGR, turned upright by its EXIF orientation.
// Throws MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE and MAQ_ERROR_IMAGE_SIZE.
void read_image_file(const std::string& path, Frame& frame);

// An image with alpha, 4 bytes a pixel in the order B, G, R, A, rows without padding.
struct BgraImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<uint8_t> pixels;
};

// Decodes an image that is in memory. Throws MAQ_ERROR_UNREADABLE; `what` names it in the error.
BgraImage decode_bgra(const uint8_t* bytes, size_t size_bytes, const std::string& what);

}  // namespace maq
