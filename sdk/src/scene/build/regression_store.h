// What is known of the points that some photo saw: memory grows with them, not with the cloud.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "scene/point_cloud.h"
#include "scene/build/descriptor_regression.h"

namespace maq {

class MomentStore {
 public:
  // For a cloud of so many points, of which nothing is known.
  void begin(size_t points) { places_.assign(points, kNowhere); }

  // How many of the points have been seen.
  size_t count() const { return points_.size(); }
  bool has(uint32_t point) const { return places_[point] != kNowhere; }
  // Memory for so many more points, so that adding them cannot fail. Nothing is known of them yet.
  void reserve(size_t more);
  // A point that is new; there must be memory for it.
  void add(uint32_t point) {
    places_[point] = uint32_t(points_.size());
    points_.push_back(point);
  }
  ViewMoments& of(uint32_t point) { return at(places_[point]); }

  // In the order in which points were seen first; neighbours in a photo are neighbours here.
  ViewMoments& at(size_t place) { return chunks_[place / kChunk][place % kChunk]; }
  const ViewMoments& at(size_t place) const { return chunks_[place / kChunk][place % kChunk]; }
  const std::vector<uint32_t>& points() const { return points_; }

  // Points that memory is taken and given back for: 33.6 MB, enough for allocators to hand it to the system and back at once.
  // What is not used of it yet is not there: the system gives zeros page by page.
  static constexpr size_t kChunk = 100'000;
  // Gives the memory of a chunk back; nothing of its points may be asked for then.
  void forget_chunk(size_t chunk) { chunks_[chunk].reset(); }

 private:
  static constexpr uint32_t kNowhere = UINT32_MAX;

  std::vector<uint32_t> places_;  // of each point of the cloud
  std::vector<uint32_t> points_;  // of each place
  struct Free {
    void operator()(ViewMoments* moments) const { std::free(moments); }
  };
  std::vector<std::unique_ptr<ViewMoments[], Free>> chunks_;
};

}  // namespace maq
