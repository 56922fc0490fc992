// A patch of one picture found in another: inverse compositional Lucas-Kanade, and what the patch says of the motion of
// its pixels.
#pragma once

#include "prediction/grey_pyramid.h"

namespace maq {

inline constexpr int kPatch_px = 8;

struct Displacement {
  float dx, dy;
};

struct Patch {
  float dx = 0, dy = 0;
  // Means over its pixels of squares of brightness around the mean: of the patch itself, of its difference from the
  // other picture where it stands still, and where it moves by (dx, dy).
  float contrast = 0, still = 0, moved = 0;
};

// Finds the patch of `from` whose first pixel is (x, y) in `to`: at the best of the candidates, made better by
// Lucas-Kanade. Those of neighbours (`is_found`: the patch has been found) must be clearly better than where it was
// found, or nothing changes. Otherwise the first candidate is standing still, and one that ties with it wins.
void search_patch(const GreyLevel& from, const GreyLevel& to, int x, int y, const Displacement* candidates, int count,
                  bool is_found, Patch& patch);

// Adds row `row` of a patch to the votes on the pixels there: weights, and weighted displacements. A pixel has the more
// weight the better it fits.
void vote(const GreyLevel& from, const GreyLevel& to, int x, int y, int row, const Patch& patch, float* weights,
          float* dx, float* dy);

// Mean of five rows, pixel by pixel.
void mean_of_five(const float* const* rows, int count, float* mean);

}  // namespace maq
