#include "image/geometry/shrink.h"

#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace maq {

void shrink(const ImageView& image, int width_px, int height_px, Frame& frame) {
  if (image.format != MAQ_PIXEL_BGR8 || width_px < 1 || height_px < 1 || width_px > image.width_px ||
      height_px > image.height_px) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A picture of ", image.width_px, " x ", image.height_px, " pixels in ",
                pixel_format_name(image.format), " cannot be shrunk to ", width_px, " x ", height_px, " in BGR.");
  }
  const cv::Mat from(image.height_px, image.width_px, CV_8UC3, const_cast<uint8_t*>(image.planes[0].data),
                     image.planes[0].stride_bytes);
  cv::Mat to(height_px, width_px, CV_8UC3, frame.allocate_bgr(width_px, height_px));
  cv::resize(from, to, to.size(), 0, 0, cv::INTER_AREA);
}

void shrink_valid(std::vector<uint8_t>& valid, int from_width_px, int from_height_px, int width_px, int height_px) {
  cv::Mat from(from_height_px, from_width_px, CV_8UC1, valid.data()), to;
  cv::threshold(from, from, 0, 255, cv::THRESH_BINARY);
  cv::resize(from, to, cv::Size(width_px, height_px), 0, 0, cv::INTER_AREA);
  cv::threshold(to, to, 254, 255, cv::THRESH_BINARY);
  valid.assign(to.begin<uint8_t>(), to.end<uint8_t>());
}

}  // namespace maq
