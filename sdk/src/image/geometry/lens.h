// How a real lens maps directions into its image, in the conventions of OpenCV.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "image/geometry/intrinsics.h"

namespace maq {

enum class Distortion { kNone, kRational, kFisheye };

struct Lens : Intrinsics {
  Distortion distortion = Distortion::kNone;
  // kRational: k1, k2, p1, p2, k3, k4, k5, k6; kFisheye: k1, k2, k3, k4.
  std::array<double, 8> coefficients{};
};

inline bool operator==(const Lens& a, const Lens& b) {
  return a.intrinsics() == b.intrinsics() && a.distortion == b.distortion && a.coefficients == b.coefficients;
}

struct PixelPosition {
  double column_px = 0, row_px = 0;
};

class LensProjection {
 public:
  explicit LensProjection(const Lens& lens);

  // Where the direction (x, y, 1) falls; outside of the image too. Nothing where the model does not hold: farther
  // from the axis than the widest angle of undistorted images, or than where the distortion stops growing.
  std::optional<PixelPosition> find(double x, double y) const;

  // The same for the directions (x[i], y, 1) of a row of pixels, with the same bits; NaN for nothing.
  void find_row(const std::vector<double>& x, double y, double* column_px, double* row_px) const;

 private:
  Lens lens_;
  double max_radius_ = 0;  // tangent of the largest angle to the axis
};

// The lens without distortion for an undistorted image of the same size and principal point. Its focal lengths are
// multiplied by the smallest factor with which every pixel of the new image comes from inside of the old one: nothing
// is blank, and parts at the edges are lost (as OpenCV's getOptimalNewCameraMatrix with alpha 0). It reaches at most 60
// degrees from the axis. Nothing where there is no such factor up to 16: the principal point is outside of the image,
// or the distortion is not invertible in it.
std::optional<Lens> without_distortion(const Lens& lens);

}  // namespace maq
