// Areas of a stream whose depth did not change keep the field of an earlier frame, and the network runs on the others.
//
// Depth is compared with that of the frame that an area's field is from, not with the frame before: what moves slowly
// is noticed as soon as it has moved by more than a footprint, or than the noise where that is more.
#pragma once

#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "edges/area_motion.h"
#include "edges/depth_slopes.h"
#include "edges/edge_field.h"

namespace maq {

class KeptField {
 public:
  static constexpr int kMaxFrames = 64;

  // `frames`, 2 to kMaxFrames: for how many frames, the first included, an area has the same field at most. 1: nothing
  // is kept, and nothing below may be called.
  explicit KeptField(int frames);

  bool is_on() const { return frames_ > 1; }

  // The part of the frame for the network to run on, as ActiveWindow's: all areas of 32 x 32 px in which depth changed
  // since their field was found, or whose field is too old, with their neighbours, which lie within eps_r of them. No
  // width: there is none. `depth` is known in part; a frame of another camera keeps nothing.
  FieldWindow find(const DepthPlane& depth, const Intrinsics& camera, int multiple_px, WorkerThreads& threads);

  // Writes what is kept into `field`, which holds what was found for the part above, and keeps that in turn. Returns
  // how many pixels have an earlier field. Takes no memory for frames of the size before.
  int64_t merge(EdgeField& field, WorkerThreads& threads);

 private:
  bool is_flicker(const float* metres, int x, int y, float jump) const;
  bool has_changed(const float* metres, const PixelArea& area) const;
  PixelArea area_at(int column, int row) const;
  int64_t merge_area(EdgeField& field, const PixelArea& area, size_t index);

  int frames_;
  Intrinsics camera_{};
  int columns_ = 0, rows_ = 0;     // of areas
  std::vector<uint8_t> changed_;   // this frame's areas
  std::vector<uint8_t> is_fresh_;  // with their neighbours
  std::vector<uint8_t> age_;       // frames that have had an area's field; 0: it has none
  std::vector<int64_t> kept_;      // pixels of each row of areas
  // As of the frame that each area's field is from.
  std::vector<float> inverse_;  // 1 / metres; 0 where depth was unknown
  std::vector<float> distance_r_, spread_r_;
  std::vector<uint8_t> kind_;
};

}  // namespace maq
