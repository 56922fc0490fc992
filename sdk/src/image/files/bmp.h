// BMP images.
#pragma once

#include "image/files/image_codecs.h"

namespace maq {

// Decodes uncompressed images of 1, 4, 8, 24 and 32 bits a pixel to BGR8, without alpha. No width: damaged or
// truncated. Throws MAQ_ERROR_UNSUPPORTED for other kinds, and std::bad_alloc.
DecodedImage decode_bmp(const EncodedBytes& bytes);

}  // namespace maq
