// How a real lens maps directions into its picture, in the conventions of OpenCV.
#pragma once

#include <array>
#include <optional>
#include <vector>

namespace maq {

enum class Distortion { kNone, kRational, kFisheye };

// The centre of the top left pixel is (0, 0).
struct Lens {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  Distortion distortion = Distortion::kNone;
  // kRational: k1, k2, p1, p2, k3, k4, k5, k6; kFisheye: k1, k2, k3, k4.
  std::array<double, 8> coefficients{};
};

inline bool operator==(const Lens& a, const Lens& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px && a.fx_px == b.fx_px && a.fy_px == b.fy_px &&
         a.cx_px == b.cx_px && a.cy_px == b.cy_px && a.distortion == b.distortion && a.coefficients == b.coefficients;
}

struct PlaceInPicture {
  double column_px = 0, row_px = 0;
};

class LensProjection {
 public:
  explicit LensProjection(const Lens& lens);

  // Where the direction (x, y, 1) falls; outside of the picture too. Nothing where the formula does not hold: farther
  // from the axis than the widest angle that undistorted pictures have, or than where the distortion folds back.
  std::optional<PlaceInPicture> find(double x, double y) const;

  // Likewise for the directions (x[i], y, 1) of a row of pixels: where they fall, to the bit as find() says; NaN where it says
  // nothing.
  void find_row(const std::vector<double>& x, double y, double* column_px, double* row_px) const;

 private:
  Lens lens_;
  double widest_ = 0;  // tangent of the largest angle to the axis
};

// The same lens with a larger or smaller picture: its field of view stays.
Lens resized(const Lens& lens, int width_px, int height_px);

// The lens without distortion for an undistorted picture of the same size and principal point. Its focal lengths are
// multiplied by the least number with which every pixel of the new picture has its place in the old one: nothing is
// blank, what is seen at the edges only in part is lost (as OpenCV's getOptimalNewCameraMatrix with alpha 0). It reaches
// at most 60 degrees from the axis. Nothing where there is no such number up to 16: the axis is outside of the picture,
// or the distortion folds it.
std::optional<Lens> without_distortion(const Lens& lens);

}  // namespace maq
