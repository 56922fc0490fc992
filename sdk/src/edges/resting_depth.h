// Depth of a camera at rest: for each pixel the mean of inverse depth over the last frames, as long as these agree.
//
// Noise of stereo and of time of flight is alike in inverse depth at all distances. What moves is told from noise by
// area: differences from the mean that a plane explains are motion, what is left of them is noise.
#pragma once

#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "image/geometry/intrinsics.h"

namespace maq {

class RestingDepth {
 public:
  static constexpr int kMaxFrames = 64;

  // `frames`, 1 to kMaxFrames: how many the mean goes over; of more, the older ones fade. 1: frames stay as they are.
  explicit RestingDepth(int frames);

  // Replaces the depth of a frame of the camera, metres in rows without padding, 0 where unknown, by the mean of it and
  // of those before. Areas in which something moves, single pixels that jump, and frames of another size or camera
  // begin anew; unknown depth stays unknown. Returns for how many pixels it is the mean of several frames. Takes no
  // memory for frames of the size before.
  int64_t add(float* metres, const Intrinsics& camera, WorkerThreads& threads);

 private:
  struct Area;

  int64_t add_row_of_areas(float* metres, int row);
  int64_t add_area(float* metres, const Area& area);

  int frames_;
  Intrinsics camera_{};
  std::vector<float> inverse_;  // means, 1 / metres
  std::vector<uint8_t> count_;  // frames in each, 0: none yet
  std::vector<int64_t> averaged_;
};

}  // namespace maq
