// Splats as they are rendered: in chunks of neighbours, each number of a chunk's splats beside the same of the others.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/splats/splats.h"

namespace maq {

inline constexpr int kChunkSplats = 256;
inline constexpr int kAxesPlanes = 9;

struct SplatChunk {
  uint32_t count = 0;                        // 1 to kChunkSplats
  std::array<double, 3> centre = {0, 0, 0};  // in the world; positions are relative to it
  float radius = 0;                          // of the ball that has every splat as far as it can be seen
  const float* position[3] = {};
  // Axes of a splat in the world, each of the length of a standard deviation: row by row, an axis in a column.
  const float* axes[kAxesPlanes] = {};
  const float* log_opacity = nullptr;
  const float* colour[3] = {};
  const int16_t* sh = nullptr;  // [term][channel][kChunkSplats]
};

class SplatChunks {
 public:
  // Sorts the splats along a curve through space. Those with an opacity below 1/255, which no pixel shows, are left
  // out.
  explicit SplatChunks(const Splats& splats);

  const std::vector<SplatChunk>& chunks() const { return chunks_; }
  int sh_degree() const { return sh_degree_; }
  bool is_antialiased() const { return is_antialiased_; }
  uint64_t count() const { return order_.size(); }

  // The splat at each place: chunk after chunk, kChunkSplats places each.
  const std::vector<uint32_t>& order() const { return order_; }
  // Changes the numbers of a place, but not the harmonics.
  void set(uint32_t place, const Splat& splat);

 private:
  int sh_degree_;
  bool is_antialiased_;
  std::vector<uint32_t> order_;
  std::vector<float> numbers_;
  std::vector<int16_t> sh_;
  std::vector<SplatChunk> chunks_;
};

}  // namespace maq
