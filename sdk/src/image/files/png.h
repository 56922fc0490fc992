// PNG images, by libpng.
#pragma once

#include <cstdint>
#include <vector>

#include "image/files/image_codecs.h"

namespace maq {

// Decodes to BGR8, the high byte of 16 bits, without alpha. No width: damaged or truncated. Throws std::bad_alloc.
DecodedImage decode_png(const EncodedBytes& bytes);

// A grey image of 16 bits as DEPTH16. One of other pixels has a size and no pixels. Otherwise like decode_png().
DecodedImage decode_depth_png(const EncodedBytes& bytes);

// BGR8, GREY8, RGBA8 or DEPTH16, quickly compressed. Throws MAQ_ERROR_INTERNAL and std::bad_alloc.
std::vector<uint8_t> encode_png(const ImageView& image);

}  // namespace maq
