// The regressions of the points that some photo saw: memory grows with them, not with the cloud.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "scene/assembly/descriptor_regression.h"
#include "scene/point_cloud.h"

namespace maq {

class RegressionStore {
 public:
  // For a cloud of so many points, none of them seen.
  void begin(size_t points) { slots_.assign(points, kNowhere); }

  // How many of the points have been seen.
  size_t count() const { return points_.size(); }
  bool has(uint32_t point) const { return slots_[point] != kNowhere; }
  // Memory for so many more points, so that adding them cannot fail.
  void reserve(size_t more);
  // A point that is new; there must be memory for it.
  void add(uint32_t point) {
    slots_[point] = uint32_t(points_.size());
    points_.push_back(point);
  }
  DescriptorRegression& of(uint32_t point) { return at(slots_[point]); }

  // In the order in which points were seen first; neighbours in a photo are neighbours here.
  DescriptorRegression& at(size_t slot) { return chunks_[slot / kChunk][slot % kChunk]; }
  const DescriptorRegression& at(size_t slot) const { return chunks_[slot / kChunk][slot % kChunk]; }
  const std::vector<uint32_t>& points() const { return points_; }

  // Points whose memory is allocated and freed at once: 33.6 MB, which allocators take from the system and give back
  // whole. The system makes its pages, zeros, when they are first used.
  static constexpr size_t kChunk = 100'000;
  // Frees the memory of a chunk; its points must not be used afterwards.
  void forget_chunk(size_t chunk) { chunks_[chunk].reset(); }

 private:
  static constexpr uint32_t kNowhere = UINT32_MAX;

  std::vector<uint32_t> slots_;   // of each point of the cloud
  std::vector<uint32_t> points_;  // of each slot
  struct Free {
    void operator()(DescriptorRegression* regressions) const { std::free(regressions); }
  };
  std::vector<std::unique_ptr<DescriptorRegression[], Free>> chunks_;
};

}  // namespace maq
