// The pixels of a photo that a head is fitted to, as rays with observations.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "head/fit/observations.h"

namespace maq::head {

struct FitRay {
  uint32_t photo = 0;
  float x_px = 0, y_px = 0;  // from the principal point
  float matte = 0;           // 0..1, or not a number: not known
  bool has_colour = false, has_point = false;
  float rgb[3] = {};    // 0..1, where has_colour
  float point[3] = {};  // of the template head, dm, where has_point
  float point_sigma_dm = 0;
};

struct FitRays {
  std::vector<FitRay> fitted, held_out;
  double cells_per_ray = 0;  // number of the encoder's cells for each ray
};

struct FitRayOptions {
  int side_px = 64;  // pixels in a row of the crop
  double held_out_fraction = 0.05;
  int margin_cells = 5;  // pixels farther than this from all cells of the head are left out
  uint64_t seed = 1;
};

// Adds the rays of a photo. Squares of 3x3 cells are held out, the same for any side_px: the next pixel over would
// tell. The colour is the mean of the crop's pixels, and unknown on the mask's edge. Template points are interpolated
// between four cells of the head that agree with each other.
void add_fit_rays(const HeadPhoto& photo, uint32_t index, const FitRayOptions& options, FitRays& rays);

}  // namespace maq::head
