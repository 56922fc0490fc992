// The bytes of SPZ files (https://github.com/nianticlabs/spz), decompressed: the head, then for all splats positions,
// opacities, colours, scales, rotations and harmonics, one after the other.
#pragma once

#include <cstdint>

namespace maq {

struct SpzHead {
  static constexpr uint32_t kMagic = 0x5053474e;  // "NGSP"
  static constexpr uint8_t kAntialiased = 1;
  uint32_t magic = kMagic;
  uint32_t version = 3;
  uint32_t count = 0;
  uint8_t sh_degree = 0;
  uint8_t fraction_bits = 12;  // of a coordinate, which has 24 bits
  uint8_t flags = 0;
  uint8_t reserved = 0;
};
static_assert(sizeof(SpzHead) == 16);

// A byte of a colour is 255 * (0.5 + kSpzColourScale * coefficient of degree 0).
inline constexpr float kSpzColourScale = 0.15f;
// A byte of a scale is 16 * (logarithm + 10).
inline constexpr float kSpzScaleSteps = 16, kSpzScaleOffset = 10;
// A byte of a harmonic is 128 + 128 * coefficient.
inline constexpr float kSpzHarmonicSteps = 128;
// The three smaller parts of a quaternion have 9 bits without the sign, for 0 to the root of a half.
inline constexpr uint32_t kSpzMaxRotation = 511;
inline constexpr float kSpzRotationRange = 0.70710678f;

}  // namespace maq
