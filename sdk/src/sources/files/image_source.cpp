#include "core/error.h"
#include "image/files/depth_file.h"
#include "image/files/image_file.h"
#include "image/geometry/intrinsics.h"
#include "image/geometry/resize.h"
#include "sources/calibration_options.h"
#include "sources/files/file_sources.h"

namespace maq {
namespace {

class ImageSource : public Source {
 public:
  explicit ImageSource(SourceUri uri) {
    const std::optional<double> depth_unit_m = take_depth_unit(uri);
    const CalibrationOptions calibration(uri);
    uri.expect_no_more_options(std::string("size, fps, depth_unit, ") + kCalibrationOptions);
    if (depth_unit_m && uri.width_px > 0) {
      throw Error(MAQ_ERROR_UNSUPPORTED, uri.text, " is depth, which is not scaled, but is to be ", uri.width_px, " x ",
                  uri.height_px, "; leave size out.");
    }
    if (depth_unit_m) {
      read_depth_file(uri.target, *depth_unit_m, image_);
    } else {
      const std::vector<uint8_t> bytes = read_encoded_image(uri.target);
      if (looks_like_depth(bytes)) {
        throw Error(MAQ_ERROR_UNSUPPORTED, uri.target,
                    " is a grey image of 16 bits or more, as depth cameras write it, and not a photo. To read it as "
                    "depth, add metres of a stored 1 and the field of view in degrees: image:",
                    uri.target, "?depth_unit=0.001&fov=60. To read it as a photo, convert it to 8 bits.");
      }
      decode_image(bytes, uri.target, image_);
    }
    intrinsics_ = calibration.intrinsics(image_.image.width_px, image_.image.height_px);
    if (uri.width_px > 0) {
      Frame scaled;
      resize_to_bgr(image_.image, uri.width_px, uri.height_px, scaled);
      scaled.origin = image_.origin;
      image_ = std::move(scaled);
      if (intrinsics_) intrinsics_ = resized(*intrinsics_, uri.width_px, uri.height_px);
    }
    info_.width_px = image_.image.width_px;
    info_.height_px = image_.image.height_px;
    info_.frame_count = 1;
  }

  const SourceInfo& info() const override { return info_; }
  const maq_intrinsics* intrinsics() const override { return intrinsics_ ? &*intrinsics_ : nullptr; }

 private:
  NextFrame read(int64_t, Frame& frame) override {
    if (delivered_) return NextFrame::kEnd;
    frame = std::move(image_);
    delivered_ = true;
    return NextFrame::kFrame;
  }

  Frame image_;
  SourceInfo info_;
  std::optional<maq_intrinsics> intrinsics_;
  bool delivered_ = false;
};

}  // namespace

std::unique_ptr<Source> open_image_source(SourceUri uri) { return std::make_unique<ImageSource>(std::move(uri)); }

}  // namespace maq
