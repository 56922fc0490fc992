#include "image/geometry/pinhole_camera.h"

#include <cmath>

#include "core/error.h"
#include "core/frame.h"

namespace maq {

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
