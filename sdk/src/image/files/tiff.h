// TIFF images (TIFF 6.0, Adobe 1992): the first image of a file, in strips or tiles, with no compression, LZW, deflate
// or PackBits.
#pragma once

#include <cstdint>
#include <vector>

#include "image/files/image_codecs.h"

namespace maq {

// Decodes grey, palette and RGB images of 8 and 16 bits to BGR8, without alpha. No width:
// damaged or truncated. Throws MAQ_ERROR_UNSUPPORTED for other kinds, and std::bad_alloc.
DecodedImage decode_tiff(const EncodedBytes& bytes);

// A grey image of 16 bits as DEPTH16, of floats as DEPTH32F; an image of other pixels has a size and no pixels.
// Otherwise like decode_tiff().
DecodedImage decode_depth_tiff(const EncodedBytes& bytes);

// DEPTH32F, compressed by deflate. Throws std::bad_alloc.
std::vector<uint8_t> encode_depth_tiff(const ImageView& depth);

}  // namespace maq
