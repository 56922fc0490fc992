#include "sources/calibration_options.h"

#include <cmath>

#include "core/error.h"

namespace maq {
namespace {

constexpr double kMinFovDeg = 0.1, kMaxFovDeg = 179;
constexpr double kMinFocalPx = 0.01, kMaxFocalPx = 1e7;
constexpr double kMaxCentrePx = 1e6;
constexpr double kMinDepthUnitM = 1e-6, kMaxDepthUnitM = 1000;
constexpr double kPi = 3.14159265358979323846;

}  // namespace

std::optional<double> take_depth_unit(SourceUri& uri) {
  if (uri.options.count("depth_unit") == 0) return {};
  return uri.take_number("depth_unit", 0, kMinDepthUnitM, kMaxDepthUnitM);
}

CalibrationOptions::CalibrationOptions(SourceUri& uri) {
  const auto is_given = [&](const char* key) { return uri.options.count(key) > 0; };
  if (is_given("fov") && (is_given("fx") || is_given("fy"))) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "fov in ", uri.text, " does not go with fx and fy; give one of them.");
  }
  if (!is_given("fov") && !is_given("fx") && (is_given("fy") || is_given("cx") || is_given("cy"))) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "fy, cx or cy in ", uri.text, " needs fx, or for cx and cy fov.");
  }
  fov_deg_ = uri.take_number("fov", 0, kMinFovDeg, kMaxFovDeg);
  fx_px_ = uri.take_number("fx", 0, kMinFocalPx, kMaxFocalPx);
  fy_px_ = uri.take_number("fy", fx_px_, kMinFocalPx, kMaxFocalPx);
  if (is_given("cx")) cx_px_ = uri.take_number("cx", 0, -kMaxCentrePx, kMaxCentrePx);
  if (is_given("cy")) cy_px_ = uri.take_number("cy", 0, -kMaxCentrePx, kMaxCentrePx);
}

std::optional<maq_intrinsics> CalibrationOptions::intrinsics(int width_px, int height_px) const {
  if (fov_deg_ == 0 && fx_px_ == 0) return {};
  maq_intrinsics made{};
  made.width_px = width_px;
  made.height_px = height_px;
  made.fx_px = fov_deg_ > 0 ? 0.5 * width_px / std::tan(fov_deg_ * kPi / 360) : fx_px_;
  made.fy_px = fov_deg_ > 0 ? made.fx_px : fy_px_;
  made.cx_px = cx_px_.value_or(0.5 * (width_px - 1));
  made.cy_px = cy_px_.value_or(0.5 * (height_px - 1));
  return made;
}

}  // namespace maq
