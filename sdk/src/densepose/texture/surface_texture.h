// The colours of a person on the body surface, from many frames.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "densepose/surface/dense_decode.h"

namespace maq {

// One square tile for each of the 24 parts, in 4 columns of 6: the tile of part p is in column (p - 1) / 6 and row
// (p - 1) % 6. In a tile, U grows to the right and V upwards.
class SurfaceTexture {
 public:
  static constexpr int kParts = 24, kColumns = 4, kRows = 6;

  // tile_px: width and height of a tile, at least 2.
  explicit SurfaceTexture(int tile_px);

  int width_px() const { return kColumns * tile_px_; }
  int height_px() const { return kRows * tile_px_; }

  // Adds the pixels of `person`, counted from 1, and returns how many. Pixels at the outline of the person are left
  // out, because they also show what is behind. `image` has the size of `planes`. Throws MAQ_ERROR_UNSUPPORTED for a
  // depth image.
  int64_t add(const ImageView& image, const DensePlanes& planes, uint8_t person);

  // Writes height_px() rows of RGBA. Alpha is the confidence: 0 where no pixel was seen, 128 after two pixels, at
  // most 255. Texels that were not seen have the colours of the texels around them.
  void draw(uint8_t* rgba, size_t stride_bytes) const;

 private:
  struct Texel {
    std::array<float, 3> colour{};  // mean of R, G, B
    float weight = 0;               // of how many pixels, at most kMaxWeight
  };

  void add_pixel(const uint8_t* bgr, int part, float u, float v);
  // Colours of a tile, [tile_px][tile_px][3]. False if no texel of it was seen.
  bool filled_tile(const Texel* tile, std::vector<float>& colours) const;

  int tile_px_;
  std::vector<Texel> texels_;  // [24][tile_px][tile_px]
  std::vector<uint8_t> memory_;
};

}  // namespace maq
