// The input of the edge network: slopes of inverse depth, and a mask of known depth
// (export/edges/depth_input.py).
//
// A plane's inverse depth is linear in pixels, so a crease is a step of the slope for any tilt of the plane.
#pragma once

#include <vector>

#include "core/worker_threads.h"
#include "image/geometry/intrinsics.h"

namespace maq {

// Rows without padding, in metres; 0 where unknown, no NaN, infinity or negative number.
struct DepthPlane {
  const float* metres = nullptr;
  int width_px = 0, height_px = 0;
};

// A part of a frame, which may reach beyond the right and lower border by less than its size inside of the frame. No
// width: none.
struct FieldWindow {
  int left_px = 0, top_px = 0, width_px = 0, height_px = 0;
};

class DepthSlopes {
 public:
  static constexpr int kFold = 2;       // each way: pixels that become channels
  static constexpr int kChannels = 12;  // 3 planes of 2 x 2 pixels

  // The network's input for a window of even sides, [height / 2][width / 2][kChannels]: channel 4 c + 2 y + x is pixel
  // (x, y) of 2 x 2 in plane c. Planes 0 and 1: g / (1 + |g|) of the slope g = f z d(1/z) towards the next pixel in x
  // and in y, in metres of depth a metre sideways, 0 where either pixel is unknown and where the window ends with the
  // frame. Plane 2: 1 where depth is known. Beyond the frame's border the planes are mirrored, so that surfaces go on
  // there: unknown depth would look like their end. `values` has room for count(window) of them. Takes no memory for a
  // window that is not larger than earlier windows.
  void make(const DepthPlane& depth, const Intrinsics& intrinsics, const FieldWindow& window, WorkerThreads& threads,
            float* values);
  static size_t count(const FieldWindow& window) {
    return size_t(window.width_px / kFold) * size_t(window.height_px / kFold) * kChannels;
  }

 private:
  std::vector<float> rows_;  // scratch of each worker
};

}  // namespace maq
