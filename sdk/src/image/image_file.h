// Image files to frames.
#pragma once

#include <string>

#include "core/frame.h"
#include "image/image_header.h"
#include "image/orientation.h"

namespace maq {

// Decodes an image file into `frame` as BGR.
// Throws MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE, MAQ_ERROR_IMAGE_SIZE, and what file_decoders() throws.
void read_image_file(const std::string& path, Frame& frame, Orientation orientation = Orientation::kUpright);

// Of the image as it is stored, from the file's first bytes where the format has it there; otherwise it is decoded.
// Throws what read_image_file() throws. The size may be over the limits.
SizePx read_image_file_size(const std::string& path);

}  // namespace maq
