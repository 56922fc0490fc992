#include "image/depth.h"

#include <cstring>

namespace maq {
namespace {

// Rows of an app may begin at any address, so pixels are copied out of them.

void row_of_16_bits(const uint8_t* from, size_t width, float unit_m, float* __restrict metres) {
  for (size_t x = 0; x < width; ++x) {
    uint16_t stored = 0;
    std::memcpy(&stored, from + 2 * x, sizeof stored);
    const int is_known = stored != UINT16_MAX;  // a product, since a branch would keep compilers from making vectors
    metres[x] = float(stored * is_known) * unit_m;
  }
}

void row_of_floats(const uint8_t* from, size_t width, float unit_m, float* __restrict metres) {
  // The positive normal numbers, read as integers, are an interval.
  constexpr uint32_t kSmallestNormal = 0x00800000, kInfinity = 0x7f800000;
  for (size_t x = 0; x < width; ++x) {
    float depth = 0;
    std::memcpy(&depth, from + 4 * x, sizeof depth);
    depth *= unit_m;
    uint32_t bits = 0;
    std::memcpy(&bits, &depth, sizeof bits);
    metres[x] = bits - kSmallestNormal < kInfinity - kSmallestNormal ? depth : 0;
  }
}

}  // namespace

void depth_in_metres(const ImageView& depth, double unit_m, float* metres) {
  const auto convert = depth.format == MAQ_PIXEL_DEPTH16 ? row_of_16_bits : row_of_floats;
  const size_t width = size_t(depth.width_px);
  for (int y = 0; y < depth.height_px; ++y, metres += width) {
    convert(depth.planes[0].data + size_t(y) * depth.planes[0].stride_bytes, width, float(unit_m), metres);
  }
}

}  // namespace maq
