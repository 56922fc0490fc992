// Image files to frames, and images to files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/frame.h"
#include "image/files/file_codecs.h"
#include "image/files/image_header.h"

namespace maq {

// Decodes an image file into `frame` as BGR.
// Throws MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE, MAQ_ERROR_IMAGE_SIZE, and what file_codecs() throws.
void read_image_file(const std::string& path, Frame& frame, Orientation orientation = Orientation::kUpright);

// Of the image as it is stored, from the file's first bytes where the format has it there; otherwise it is decoded.
// Throws what read_image_file() throws. The size may be over the limits.
SizePx read_image_file_size(const std::string& path);

// GREY8 as one channel, all others in colour; `extension` is ".png" or ".jpg".
// Throws MAQ_ERROR_UNSUPPORTED for a depth image, and what file_codecs() throws.
std::vector<uint8_t> encode_image(const ImageView& image, const std::string& extension);

// PNG or JPEG by the extension of `path`, written atomically.
// Throws MAQ_ERROR_INVALID_ARGUMENT for another extension, MAQ_ERROR_UNWRITABLE, and what encode_image() throws.
void write_image_file(const ImageView& image, const std::string& path);

}  // namespace maq
