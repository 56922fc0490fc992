// The options of a source's URI with the meaning of its pixels: "?fov=60" or "?fx=380&fy=381&cx=318&cy=242" give the
// intrinsics, "?depth_unit=0.001" the unit of depth.
#pragma once

#include <optional>

#include "maquette/source.h"
#include "sources/uri.h"

namespace maq {

// For the list of options that a source knows.
constexpr char kCalibrationOptions[] = "fov, fx, fy, cx, cy";

// Takes "depth_unit" off the list: metres of 1 in stored depth; nothing when it was not given. Throws
// MAQ_ERROR_INVALID_ARGUMENT for an invalid value.
std::optional<double> take_depth_unit(SourceUri& uri);

// The calibration options. The size of the images is known when the source is open.
class CalibrationOptions {
 public:
  // Takes the options off the list. Throws MAQ_ERROR_INVALID_ARGUMENT for an invalid focal length, field of view or
  // position, for fov together with fx, and for other options without fov or fx.
  explicit CalibrationOptions(SourceUri& uri);
  CalibrationOptions() = default;

  // Returns intrinsics without distortion for images of this size; nothing without options. The default principal point
  // is the middle.
  std::optional<maq_intrinsics> intrinsics(int width_px, int height_px) const;

 private:
  double fov_deg_ = 0;  // from the left edge to the right; 0: not given
  double fx_px_ = 0, fy_px_ = 0;
  std::optional<double> cx_px_, cy_px_;
};

}  // namespace maq
