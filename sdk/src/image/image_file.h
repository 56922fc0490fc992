// Image files to frames.
#pragma once

#include <string>

#include "core/frame.h"

namespace maq {

// Decodes an image file into `frame` as BGR, turned upright by its EXIF orientation.
// Throws MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE, MAQ_ERROR_IMAGE_SIZE, and what file_decoders() throws.
void read_image_file(const std::string& path, Frame& frame);

}  // namespace maq
