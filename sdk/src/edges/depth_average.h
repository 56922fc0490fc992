// Temporal depth averaging for a static camera: mean inverse depth of each pixel over the last frames that agree.
//
// The noise of stereo and time of flight is similar in inverse depth at all distances. Motion is detected by area:
// differences from the mean that a plane explains are motion, the residual is noise.
#pragma once

#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "image/geometry/intrinsics.h"

namespace maq {

class DepthAverage {
 public:
  static constexpr int kMaxFrames = 64;

  // `frames`, 1 to kMaxFrames: length of the average; older frames fade. 1: no averaging.
  explicit DepthAverage(int frames);

  // Replaces the depth of a frame (metres, rows without padding, 0 where unknown) by its mean with earlier frames.
  // Areas with motion, single pixels that jump, and frames of another size or camera start a new average. Unknown depth
  // stays unknown. Returns the number of pixels whose depth is the mean of several frames. Takes no memory for frames
  // of the same size.
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
