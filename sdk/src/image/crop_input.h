// A part of an image, rotated and scaled, as the input of a network.
#pragma once

#include <vector>

#include "core/frame.h"
#include "image/network_input.h"

namespace maq {

struct Point {
  double x = 0, y = 0;
};

// Maps one image to another, in continuous coordinates: pixel (x, y) covers [x, x + 1) x [y, y + 1).
struct AffineMap {
  double xx = 1, xy = 0, shift_x = 0;  // x' = xx x + xy y + shift_x
  double yx = 0, yy = 1, shift_y = 0;  // y' = yx x + yy y + shift_y

  Point operator()(const Point& point) const {
    return {xx * point.x + xy * point.y + shift_x, yx * point.x + yy * point.y + shift_y};
  }
  // This map first, then `second`.
  AffineMap then(const AffineMap& second) const;
  // Inverts a map whose determinant is not 0.
  AffineMap inverse() const;
};

struct CropInput {
  std::vector<float> values;  // [3, height, width]: R, G, B, normalised; zero beyond the image

  // Scratch, kept from crop to crop.
  NetworkInput window;
};

// The rectangle of `crop_size` pixels that `to_image`, a rotation and a scaling, takes to its place in `image`.
// Bilinear; where the crop is much coarser than the image, of pixels averaged before.
void make_crop_input(const ImageView& image, const AffineMap& to_image, const NetworkSize& crop_size,
                     const NetworkInputSpec& spec, CropInput& crop);

}  // namespace maq
