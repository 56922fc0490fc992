// Which point each pixel of a picture shows: the nearest, and of equally deep ones that with the lowest index.
//
// A pixel is a key: the depth's bits (ordered as positive floats are), then the index; the least wins, whoever draws
// first. So several threads may draw, each into a sheet of its own, and the least of all sheets is the same picture.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "scene/visibility/point_projection.h"

namespace maq {

using DepthKey = int64_t;
// A point so much farther than one beside it is behind it (export/scenes/config.py has the same).
inline constexpr double kHidingShare = 0.1;
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
  // An empty picture, drawn by so many workers. Throws MAQ_ERROR_IMAGE_SIZE and what is of no memory.
  void begin(const PinholeCamera& camera, double near, int workers);

  // Draws points. Different workers may draw at once.
  void draw(const PointSpan& span, int worker);

  // Brings the workers' sheets together in rows [top, bottom), after all is drawn and before keys() is read there.
  // Different rows may be finished at once.
  void finish(int top, int bottom);

  // A side of the blocks that hide() looks at, pixels.
  static constexpr int kHidingPx = 4;
  // Of what is finished in rows [top, bottom), takes out the points that shine through holes of what is before them: those
  // farther than the nearest of their block, counted from the first pixel, by more than that share of its depth. `top` is
  // a multiple of kHidingPx, `bottom` too or the height. Different rows may be worked on at once.
  void hide(int top, int bottom, double share);

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  // Row by row.
  const DepthKey* keys() const { return sheets_[0].keys.data(); }

 private:
  struct Sheet {
    std::vector<DepthKey> keys;  // one more than pixels: there what is not seen is drawn
    bool is_drawn = false;       // else its keys are those of an earlier picture
  };
  void clear(Sheet& sheet);

  PointProjection projection_;
  int width_px_ = 0, height_px_ = 0;
  std::vector<Sheet> sheets_;
};

}  // namespace maq
