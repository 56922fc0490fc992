// The encoder's output for a photo, as observations in pixels of the photo.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/math/vec3.h"
#include "image/crop_input.h"

namespace maq::head {

// Channels of the encoder's output [side][side][kCellChannels]: template point x, y, z (dm), log of its sigma, logit of
// the head's mask, normal x, y, z.
inline constexpr size_t kCellChannels = 8;

// "At this pixel one sees that point of the template head, give or take sigma."
struct HeadCell {
  bool is_usable = false;     // all numbers are finite and it lies in the photo; all below is 0 where it is not
  double x_px = 0, y_px = 0;  // of the photo; the centre of its first pixel is (0, 0)
  Vec3 template_point;        // dm, in the template head's frame
  double sigma_dm = 0;
  double matte = 0;  // 0..1: how much of it is the head
};

struct HeadObservations {
  int side = 0;                 // cells a row
  double cell_px = 0;           // their distance in the photo
  std::vector<HeadCell> cells;  // [side][side]
  size_t unusable = 0;
  AffineMap crop_to_photo, photo_to_crop;  // continuous coordinates: a pixel's centre is at its number + 0.5
};

struct CellGrid {
  int side = 48;
  int cell_px = 4;  // of the crop; the centre of cell (i, j) is that of cell_px x cell_px of its pixels
};

// A photo of a head, and the known values of its camera.
struct HeadPhoto {
  HeadObservations seen;
  std::optional<HeadObservations> face;  // of the second pass; none if no face is seen
  int width_px = 0, height_px = 0;
  double focal_px = 0;            // the prior's median
  double log_focal_sigma = 0.35;  // of the log-normal prior, 0..3; 0: the focal length is known
  double cx_px = 0, cy_px = 0;
  // The crop that the encoder saw, [rgb_side][rgb_side][3], R, G, B in 0..255, with the map of `seen`. May be empty:
  // then colours are not fitted.
  int rgb_side = 0;
  std::vector<float> rgb;
};

// `cells`: [side][side][kCellChannels]. crop_to_photo takes the crop's square (0, 0)..(side cell_px) to its place; it
// is a rotation and a scaling. Cells that are not finite, beyond 16 dm, or outside a photo of width x height (0: of any
// size) are counted as unusable. Sigmas are held within 0.01 and 3 dm.
// Throws MAQ_ERROR_INVALID_ARGUMENT for a map that is not finite or turns the crop over, or no cells.
HeadObservations read_observations(const float* cells, const CellGrid& grid, const AffineMap& crop_to_photo,
                                   int width_px = 0, int height_px = 0);

}  // namespace maq::head
