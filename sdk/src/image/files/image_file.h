// Image files to frames, and images to files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/frame.h"
#include "image/files/image_header.h"

namespace maq {

// Whether an image is rotated as its EXIF orientation says or left as it is stored.
enum class Orientation { kUpright, kAsStored };

// Throws the errors of decode_image() that the first bytes of an encoded image show. `origin` names it in errors.
void check_image_start(const EncodedBytes& start, const std::string& origin);

// A file or a pipe, still encoded, whose first bytes were checked. Throws the errors of read_file() too.
std::vector<uint8_t> read_encoded_image(const std::string& path);

// Decodes an image, a whole JPEG, PNG, WebP, BMP or TIFF file, into `frame` as BGR, with its origin. `origin` names it
// in errors. Throws MAQ_ERROR_UNREADABLE for a file that is damaged, truncated or not an image, MAQ_ERROR_UNSUPPORTED
// for other formats and for rare kinds of BMP and TIFF, and MAQ_ERROR_IMAGE_SIZE.
void decode_image(const EncodedBytes& bytes, const std::string& origin, Frame& frame,
                  Orientation orientation = Orientation::kUpright);

// Reads a file or a pipe. Also throws the errors of read_file().
void read_image_file(const std::string& path, Frame& frame, Orientation orientation = Orientation::kUpright);

// Returns the stored size, from the file's first bytes if the format has it there. Otherwise decodes the file.
// Throws the errors of read_image_file(). The size may be over the limits.
SizePx read_image_file_size(const std::string& path);

// GREY8 as one channel, all others in colour; `extension` is ".png" or ".jpg".
// Throws MAQ_ERROR_UNSUPPORTED for a depth image, and the errors of encode_stored_image().
std::vector<uint8_t> encode_image(const ImageView& image, const std::string& extension);

// PNG or JPEG by the extension of `path`, written atomically. The file of a predicted frame says so (origin_mark.h).
// Throws MAQ_ERROR_INVALID_ARGUMENT for another extension, MAQ_ERROR_UNWRITABLE, and the errors of encode_image().
void write_image_file(const ImageView& image, const std::string& path, const FrameOrigin& origin = {});

// Writes an alpha plane, too: one byte a pixel of a BGR8 image, rows without padding.
// Throws MAQ_ERROR_INVALID_ARGUMENT for an extension other than .png too.
void write_image_file(const ImageView& image, const uint8_t* alpha, const std::string& path);

}  // namespace maq
