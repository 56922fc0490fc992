// The size of an encoded image from its first bytes, so that one that is too large is refused before it is decoded.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace maq {

struct SizePx {
  int64_t width = 0;
  int64_t height = 0;
};

// Of PNG, JPEG, WebP, BMP and GIF; nothing for other formats and for truncated headers.
std::optional<SizePx> read_image_size(const std::vector<uint8_t>& bytes);

}  // namespace maq
