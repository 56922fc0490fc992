// The people of stub:people: sprites of rendered people in a walk cycle, moving through a plain room.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "image/sprite.h"

namespace maq {

class StubPeople {
 public:
  // `count` people whose appearance, sizes, paths and speeds follow from `seed`.
  // Throws MAQ_ERROR_UNSUPPORTED when this build has no sprites.
  StubPeople(int count, uint64_t seed, int width_px, int height_px);

  // Draws the scene at `time_s` into `frame`, which has the size given above.
  void draw(double time_s, Frame& frame) const;

 private:
  struct Walker {
    int row = 0;                   // row of the sheet: which person
    int height_px = 0;             // height of the whole painted tile
    double feet_y_px = 0;          // the nearer, the lower and the larger
    double start_x_px = 0;         // centre of the tile at time 0
    double speed_px_s = 0;         // negative: to the left
    double phase_frames = 0;       // where in the walk cycle at time 0
    double cycles_s = 0;           // walk cycles a second
    std::vector<BgraImage> tiles;  // one for each frame of the cycle, at the drawn size, mirrored when going left
  };

  int width_px_;
  std::vector<uint8_t> background_;  // BGR
  std::vector<Walker> walkers_;      // the farthest first
};

}  // namespace maq
