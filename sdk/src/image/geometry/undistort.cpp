#include "image/geometry/undistort.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace maq {

// The way from the undistorted picture into the distorted one is a formula. It is written out in lens.cpp because OpenCV
// has it in calib3d, which is three more libraries for an app to ship, and says nothing of places where the formula folds
// back into the picture.
void undistort(const ImageView& distorted, const Lens& lens, const Lens& undistorted, Frame& frame,
               std::vector<uint8_t>& valid) {
  if (distorted.format != MAQ_PIXEL_BGR8 || distorted.width_px != lens.width_px ||
      distorted.height_px != lens.height_px) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The picture is ", distorted.width_px, " x ", distorted.height_px,
                " pixels in ", pixel_format_name(distorted.format), ", but its lens is for ", lens.width_px, " x ",
                lens.height_px, " in BGR.");
  }
  check_image_size(undistorted.width_px, undistorted.height_px, "The undistorted picture");
  const int width = undistorted.width_px, height = undistorted.height_px;
  const cv::Mat from(lens.height_px, lens.width_px, CV_8UC3, const_cast<uint8_t*>(distorted.planes[0].data),
                     distorted.planes[0].stride_bytes);
  cv::Mat to(height, width, CV_8UC3, frame.allocate_bgr(width, height));
  valid.assign(size_t(width) * size_t(height), 0);

  const LensProjection projection(lens);
  const double right = lens.width_px - 0.5, bottom = lens.height_px - 0.5;
  constexpr int kStripRows = 32;
  cv::Mat columns(kStripRows, width, CV_32FC1), rows(kStripRows, width, CV_32FC1);
  for (int top = 0; top < height; top += kStripRows) {
    const int count = std::min(kStripRows, height - top);
    for (int i = 0; i < count; ++i) {
      uint8_t* is_valid = valid.data() + size_t(top + i) * size_t(width);
      const double y = (top + i - undistorted.cy_px) / undistorted.fy_px;
      for (int x = 0; x < width; ++x) {
        const auto at = projection.find((x - undistorted.cx_px) / undistorted.fx_px, y);
        const bool is_inside =
            at && at->column_px >= -0.5 && at->column_px <= right && at->row_px >= -0.5 && at->row_px <= bottom;
        columns.at<float>(i, x) = is_inside ? float(at->column_px) : 0;
        rows.at<float>(i, x) = is_inside ? float(at->row_px) : 0;
        is_valid[x] = is_inside ? 255 : 0;
      }
    }
    cv::Mat strip = to.rowRange(top, top + count);
    cv::remap(from, strip, columns.rowRange(0, count), rows.rowRange(0, count), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    for (int i = 0; i < count; ++i) {
      for (int x = 0; x < width; ++x) {
        if (valid[size_t(top + i) * size_t(width) + size_t(x)] == 0) strip.at<cv::Vec3b>(i, x) = {};
      }
    }
  }
}

}  // namespace maq
