// WebP images, by libwebp.
#pragma once

#include "image/files/image_codecs.h"

namespace maq {

// Decodes to BGR8, without alpha. No width: damaged or truncated. Throws std::bad_alloc.
DecodedImage decode_webp(const EncodedBytes& bytes);

}  // namespace maq
