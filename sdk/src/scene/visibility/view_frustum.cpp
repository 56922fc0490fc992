#include "scene/visibility/view_frustum.h"

#include <cmath>

namespace maq {
namespace {

// Rounding of float arithmetic with a few terms, and a margin of one pixel around the image.
constexpr double kRounding = 1e-6, kMargin_px = 1;

}  // namespace

ViewFrustum::ViewFrustum(const PinholeCamera& camera, double near) : centre_(camera.centre) {
  // For depths above 0, across / forward + cx >= -0.5 is across + (cx + 0.5) forward >= 0; so with the other edges.
  const auto plane = [&](double across, double down, double forward, double min_distance) {
    Plane made{{}, {}, min_distance};
    for (size_t i = 0; i < 3; ++i) {
      const double terms[3] = {across * camera.fx_px * camera.rotation[i], down * camera.fy_px * camera.rotation[3 + i],
                               forward * camera.rotation[6 + i]};
      made.along[i] = terms[0] + terms[1] + terms[2];
      made.rounding[i] = kRounding * (std::abs(terms[0]) + std::abs(terms[1]) + std::abs(terms[2]));
    }
    return made;
  };
  planes_[0] = plane(0, 0, 1, near);
  planes_[1] = plane(1, 0, camera.cx_px + 0.5 + kMargin_px, 0);
  planes_[2] = plane(-1, 0, camera.width_px - 0.5 + kMargin_px - camera.cx_px, 0);
  planes_[3] = plane(0, 1, camera.cy_px + 0.5 + kMargin_px, 0);
  planes_[4] = plane(0, -1, camera.height_px - 0.5 + kMargin_px - camera.cy_px, 0);
}

bool ViewFrustum::may_show(const Scene& scene, const SceneBlock& block) const {
  double middle[3], half[3];
  for (size_t i = 0; i < 3; ++i) {
    const double low = block.low[i];
    // As far as stored positions reach, whatever the bounds say.
    const double high =
        scene.position_format == PositionFormat::kUint16 ? low + 65535.0 * block.position_step[i] : block.high[i];
    middle[i] = scene.origin[i] - centre_[i] + (low + high) / 2;
    half[i] = (high - low) / 2;
  }
  for (const Plane& plane : planes_) {
    double farthest = 0, rounding = 0;
    for (size_t i = 0; i < 3; ++i) {
      farthest += plane.along[i] * middle[i] + std::abs(plane.along[i]) * half[i];
      rounding += plane.rounding[i] * (std::abs(middle[i]) + half[i]);
    }
    if (farthest < plane.min_distance - rounding - kRounding * std::abs(plane.min_distance)) return false;
  }
  return true;
}

}  // namespace maq
