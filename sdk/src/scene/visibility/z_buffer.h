// Which point is visible at each pixel: the front-most, and of equally deep ones that with the lowest index.
//
// A pixel is a key: the depth's bits (ordered as positive floats are), then the index; the smallest is kept, in
// whatever order points are drawn. Each thread therefore draws into its own depth buffer, and the minimum of all gives
// the same image.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "scene/visibility/point_projection.h"

namespace maq {

using DepthKey = int64_t;
// Relative depth tolerance: a point farther than one beside it by over that fraction is occluded
// (export/scenes/config.py has the same).
inline constexpr double kDepthTolerance = 0.1;
inline constexpr DepthKey kNoPointKey = std::numeric_limits<int64_t>::max();

inline uint32_t point_of(DepthKey key) { return uint32_t(key); }
// Along the optical axis; not a number for kNoPointKey.
inline float depth_of(DepthKey key) {
  const uint32_t bits = uint32_t(uint64_t(key) >> 32);
  float depth;
  std::memcpy(&depth, &bits, sizeof depth);
  return depth;
}

class ZBuffer {
 public:
  // Begins an empty image, drawn by `workers` workers. Throws MAQ_ERROR_IMAGE_SIZE, std::bad_alloc.
  void begin(const PinholeCamera& camera, double near, int workers);

  // Draws points. Different workers may draw at once.
  void draw(const PointSpan& span, int worker);

  // Merges the workers' buffers in rows [top, bottom), after all is drawn and before keys() is read there.
  // Different rows may be finished at once.
  void finish(int top, int bottom);

  // A side of the blocks that remove_occluded() works on, pixels.
  static constexpr int kOcclusionBlockPx = 4;
  // In finished rows [top, bottom), removes points that bleed through holes of a nearer surface. These are farther than
  // the nearest point of their block (counted from the first pixel) by over that fraction of its depth. `top` is a
  // multiple of kOcclusionBlockPx, `bottom` too or the height. Different rows may be processed at once.
  void remove_occluded(int top, int bottom, double depth_tolerance);

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  // Row by row.
  const DepthKey* keys() const { return buffers_[0].keys.data(); }

 private:
  struct DepthBuffer {
    std::vector<DepthKey> keys;  // one more than pixels: for points outside of the image
    bool is_drawn = false;       // else its keys are of an earlier image
  };
  void clear(DepthBuffer& buffer);

  PointProjection projection_;
  int width_px_ = 0, height_px_ = 0;
  std::vector<DepthBuffer> buffers_;  // one for each worker
};

}  // namespace maq
