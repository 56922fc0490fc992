// The luma of a frame at halving sizes, as floats with a border, so that patches may cross the edges.
#pragma once

#include <cstddef>
#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"

namespace maq {

// Throws MAQ_ERROR_UNSUPPORTED for a depth image.
void require_no_depth(const ImageView& image);

// The edge pixels are repeated kBorder_px beyond the image.
struct LumaLevel {
  static constexpr int kBorder_px = 12;

  int width_px = 0, height_px = 0;
  std::vector<float> memory;  // 0 to 255

  size_t stride() const { return size_t(width_px + 2 * kBorder_px); }
  // Returns pixel (x, y); both may be negative.
  const float* at(int x, int y) const { return memory.data() + offset(x, y); }
  float* at(int x, int y) { return memory.data() + offset(x, y); }
  void resize(int width, int height);

 private:
  size_t offset(int x, int y) const { return size_t(y + kBorder_px) * stride() + size_t(x + kBorder_px); }
};

class LumaPyramid {
 public:
  // Longer side of the finest level at most, unless the frame's is less than half more.
  static constexpr int kLongSide_px = 320;
  static constexpr int kMinSide_px = 16;  // of the coarsest level, unless the image is smaller

  // Computes all levels of an image. Allocates nothing for a known size and thread count. Throws MAQ_ERROR_UNSUPPORTED
  // for a depth image.
  void set(const ImageView& image, WorkerThreads& threads);
  // Computes the coarser levels from a finest level that copy_finest() returned: rows without a border.
  void set_finest(const float* luma, int width_px, int height_px, int scale);
  void copy_finest(float* luma) const;

  // One pixel of the finest level is the mean of scale() x scale() frame pixels.
  int scale() const { return scale_; }
  // The finest first; at least one.
  size_t level_count() const { return count_; }
  const LumaLevel& level(size_t index) const { return levels_[index]; }

 private:
  void resize(int width, int height);
  void set_coarser();

  int scale_ = 1;
  size_t count_ = 0;
  std::vector<float> means_;  // the finest level before smoothing
  // [workers]: sums of the frame rows under one pixel, and a row smoothed in one axis.
  std::vector<std::vector<int>> sums_;
  std::vector<std::vector<float>> columns_;
  std::vector<LumaLevel> levels_;  // count_ in use; more after larger images
};

}  // namespace maq
