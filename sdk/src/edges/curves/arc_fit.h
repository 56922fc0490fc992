// Circular arcs through points in space.
#pragma once

#include <optional>
#include <vector>

#include "edges/curves/line_fit.h"

namespace maq {

// centre + cos(a) x_axis + sin(a) y_axis, 0 <= a <= sweep_rad; the axes are orthogonal and as long as the radius. Seen
// from the origin, the camera, it runs clockwise in an image whose y axis points down.
struct ArcFit {
  Vec3 centre, x_axis, y_axis;
  double sweep_rad = 0;
  bool is_closed = false;
  double rms = 0;  // units
};

class ArcFitter {
 public:
  // Fits by Gauss-Newton on the distances to the circle, in the plane of least squares. Returns nothing where a
  // straight line fits as well (the height of the arc is within the noise of its points), for fewer than four points,
  // and for points that are not finite. The order of points has no effect.
  std::optional<ArcFit> fit(const FitPoint* points, size_t count);

 private:
  struct Flat {
    double x, y, unit, weight;
  };
  std::vector<Flat> flat_;
  std::vector<double> angles_;
};

}  // namespace maq
