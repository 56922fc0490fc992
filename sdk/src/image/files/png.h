// PNG images, by libpng itself: OpenCV lets it write messages about a file to stderr.
#pragma once

#include <cstddef>
#include <cstdint>

#include "image/files/file_codecs.h"

namespace maq {

// Decodes to BGR8, the high byte of 16 bits, without alpha. No width: damaged or truncated. Throws std::bad_alloc.
DecodedImage decode_png(const uint8_t* bytes, size_t size_bytes);

// A grey image of 16 bits as DEPTH16. One of other pixels has a size and no pixels. Otherwise as above.
DecodedImage decode_depth_png(const uint8_t* bytes, size_t size_bytes);

}  // namespace maq
