// Image files to frames, and images to files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/frame.h"
#include "image/files/file_codecs.h"
#include "image/files/image_header.h"

namespace maq {

// Whether an image is rotated as its EXIF orientation says or left as it is stored.
enum class Orientation { kUpright, kAsStored };

// Throws what decode_image() throws for what cannot be decoded, as far as the first bytes of an encoded image tell.
// `origin` names it in errors.
void check_image_start(const EncodedBytes& start, const std::string& origin);

// A file or a pipe, still encoded, whose first bytes were checked. Throws what read_file() throws too.
std::vector<uint8_t> read_encoded_image(const std::string& path);

// Decodes an image, a whole JPEG, PNG, WebP, BMP or TIFF file, into `frame` as BGR, with its origin. `origin` names it
// in errors. Throws MAQ_ERROR_UNREADABLE for what is damaged, truncated or no image, MAQ_ERROR_UNSUPPORTED for other
// formats, MAQ_ERROR_IMAGE_SIZE, and, but for JPEG, what file_codecs() throws.
void decode_image(const EncodedBytes& bytes, const std::string& origin, Frame& frame,
                  Orientation orientation = Orientation::kUpright);

// The same of a file or a pipe. Throws what read_file() throws too.
void read_image_file(const std::string& path, Frame& frame, Orientation orientation = Orientation::kUpright);

// Of the image as it is stored, from the file's first bytes where the format has it there; otherwise it is decoded.
// Throws what read_image_file() throws. The size may be over the limits.
SizePx read_image_file_size(const std::string& path);

// GREY8 as one channel, all others in colour; `extension` is ".png" or ".jpg".
// Throws MAQ_ERROR_UNSUPPORTED for a depth image, and what file_codecs() throws.
std::vector<uint8_t> encode_image(const ImageView& image, const std::string& extension);

// PNG or JPEG by the extension of `path`, written atomically. The file of a predicted frame says so (origin_mark.h).
// Throws MAQ_ERROR_INVALID_ARGUMENT for another extension, MAQ_ERROR_UNWRITABLE, and what encode_image() throws.
void write_image_file(const ImageView& image, const std::string& path, const FrameOrigin& origin = {});

// The same with an alpha plane: one byte a pixel of a BGR8 image, rows without padding.
// Throws MAQ_ERROR_INVALID_ARGUMENT for an extension other than .png too.
void write_image_file(const ImageView& image, const uint8_t* alpha, const std::string& path);

}  // namespace maq
