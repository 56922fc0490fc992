#include "scene/pinhole_camera.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/frame.h"

namespace maq {

PinholeCamera gravity_aligned(const PinholeCamera& camera, const std::array<double, 3>& up) {
  const auto& r = camera.rotation;
  const double length = std::sqrt(up[0] * up[0] + up[1] * up[1] + up[2] * up[2]);
  if (!(length > 0) || !std::isfinite(length)) return camera;
  // The world's up as the camera sees it, across its axis.
  const double across = (r[0] * up[0] + r[1] * up[1] + r[2] * up[2]) / length;
  const double down = (r[3] * up[0] + r[4] * up[1] + r[5] * up[2]) / length;
  const double seen = std::hypot(across, down);
  // Nearly along the axis its direction in the picture says less and less; the rotation fades out.
  constexpr double kFaintest = 0.05;
  const double angle = std::atan2(across, -down) * std::min(1.0, seen / kFaintest);
  const double cosine = std::cos(angle), sine = std::sin(angle);
  PinholeCamera made = camera;
  for (size_t i = 0; i < 3; ++i) {
    made.rotation[i] = cosine * r[i] + sine * r[3 + i];
    made.rotation[3 + i] = cosine * r[3 + i] - sine * r[i];
  }
  return made;
}

void check_camera(const PinholeCamera& camera, const char* what) {
  check_image_size(camera.width_px, camera.height_px, what);
  bool is_finite = true;
  for (const double value : {camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px}) {
    is_finite = is_finite && std::isfinite(value);
  }
  for (const double value : camera.rotation) is_finite = is_finite && std::isfinite(value);
  for (const double value : camera.centre) is_finite = is_finite && std::isfinite(value);
  if (!is_finite) throw Error(MAQ_ERROR_INVALID_ARGUMENT, what, " has numbers that are not finite.");
  if (!(camera.fx_px > 0 && camera.fy_px > 0)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, what, " has focal lengths ", camera.fx_px, " and ", camera.fy_px,
                " pixels, but they must be positive.");
  }
  constexpr double kTolerance = 1e-3;
  const auto& r = camera.rotation;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = i; j < 3; ++j) {
      const double product = r[3 * i] * r[3 * j] + r[3 * i + 1] * r[3 * j + 1] + r[3 * i + 2] * r[3 * j + 2];
      if (std::abs(product - (i == j ? 1 : 0)) > kTolerance) {
        throw Error(MAQ_ERROR_INVALID_ARGUMENT, what,
                    " has a rotation whose rows are not of length 1 at right angles.");
      }
    }
  }
  const double volume =
      r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) + r[2] * (r[3] * r[7] - r[4] * r[6]);
  if (volume < 0) throw Error(MAQ_ERROR_INVALID_ARGUMENT, what, " has a rotation that mirrors the world.");
}

}  // namespace maq
