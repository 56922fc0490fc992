// A frame's brightness at sizes that halve, for finding motion: floats with a border, so that patches may lie beyond
// the picture's edges.
#pragma once

#include <cstddef>
#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"

namespace maq {

// Throws MAQ_ERROR_UNSUPPORTED for a depth image.
void require_picture(const ImageView& image);

// Beyond the edges the last pixels are repeated, kBorder_px far.
struct GreyLevel {
  static constexpr int kBorder_px = 12;

  int width_px = 0, height_px = 0;
  std::vector<float> memory;  // 0 to 255

  size_t stride() const { return size_t(width_px + 2 * kBorder_px); }
  // Of pixel (x, y), which may be negative.
  const float* at(int x, int y) const { return memory.data() + offset(x, y); }
  float* at(int x, int y) { return memory.data() + offset(x, y); }
  void resize(int width, int height);

 private:
  size_t offset(int x, int y) const { return size_t(y + kBorder_px) * stride() + size_t(x + kBorder_px); }
};

class GreyPyramid {
 public:
  // Of the finest level: its longer side is that or less, unless the frame's is by less than a half more.
  static constexpr int kLongSide_px = 320;
  static constexpr int kMinSide_px = 16;  // of the coarsest level, unless the picture is smaller

  // Of an image. Here and below nothing is taken from the heap for a size and a number of threads that were there
  // before. Throws MAQ_ERROR_UNSUPPORTED for a depth image.
  void set(const ImageView& image, WorkerThreads& threads);
  // That of an image whose finest level was kept, in rows without a border.
  void set_finest(const float* grey, int width_px, int height_px, int scale);
  void copy_finest(float* grey) const;

  // Pixels of the frame, each way, that one of the finest level is the mean of.
  int scale() const { return scale_; }
  // The finest first; at least one.
  size_t level_count() const { return count_; }
  const GreyLevel& level(size_t index) const { return levels_[index]; }

 private:
  void resize(int width, int height);
  void set_coarser();

  int scale_ = 1;
  size_t count_ = 0;
  std::vector<float> means_;  // of the finest level, before it is smoothed
  // Of a worker each: sums over the rows that a pixel is the mean of, and a row smoothed one way.
  std::vector<std::vector<int>> sums_;
  std::vector<std::vector<float>> columns_;
  std::vector<GreyLevel> levels_;  // count_, and others of larger images
};

}  // namespace maq
