// Finds a patch of one image in another by inverse compositional Lucas-Kanade, and votes on the motion of its pixels.
#pragma once

#include "prediction/flow/luma_pyramid.h"

namespace maq {

inline constexpr int kPatch_px = 8;

struct Displacement {
  float dx, dy;
};

struct Patch {
  float dx = 0, dy = 0;
  // Variances of luma: of the patch, of its difference to the other image at displacement 0, and at (dx, dy).
  float contrast = 0, still = 0, moved = 0;
};

// Finds the patch of `from` whose first pixel is (x, y) in `to`: starts at the best candidate and improves it by
// Lucas-Kanade. With `is_found`, the candidates are neighbours' displacements and must be clearly better than the
// patch's own. Without, the first candidate is displacement 0, and a tie with it wins.
void search_patch(const LumaLevel& from, const LumaLevel& to, int x, int y, const Displacement* candidates, int count,
                  bool is_found, Patch& patch);

// Adds row `row` of a patch to the votes on its pixels: weights and weighted displacements. Pixels that fit better
// weigh more.
void vote(const LumaLevel& from, const LumaLevel& to, int x, int y, int row, const Patch& patch, float* weights,
          float* dx, float* dy);

// Averages five rows pixel by pixel.
void mean_of_five(const float* const* rows, int count, float* mean);

}  // namespace maq
