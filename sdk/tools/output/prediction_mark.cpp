#include "output/prediction_mark.h"

#include <algorithm>
#include <cstdio>
#include <opencv2/imgproc.hpp>

namespace {

const cv::Scalar kMarkColour(255, 0, 255);  // magenta: rare in images
constexpr int kMinSideOfText_px = 100;

}  // namespace

void draw_caption(const std::string& text, cv::Mat& image) {
  if (image.cols < kMinSideOfText_px) return;
  const double scale = std::max(0.4, image.rows / 800.0);
  const int thickness = scale > 0.8 ? 2 : 1;
  int below = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, thickness, &below);
  cv::rectangle(image, cv::Rect(0, 0, size.width + 12, size.height + below + 10), cv::Scalar(), cv::FILLED);
  cv::putText(image, text, cv::Point(6, size.height + 6), cv::FONT_HERSHEY_SIMPLEX, scale, cv::Scalar(255, 255, 255),
              thickness, cv::LINE_AA);
}

void draw_prediction_mark(const maquette::Frame& frame, cv::Mat& image) {
  const maq_frame_origin origin = frame.origin();
  if (origin.kind != MAQ_FRAME_PREDICTED) return;
  char text[64];
  std::snprintf(text, sizeof text, "predicted +%lld ms", (long long)(origin.horizon_ns / 1000000));
  draw_caption(text, image);
  const int width = std::max(1, std::min(image.cols, image.rows) / 60);
  cv::rectangle(image, cv::Rect(0, 0, image.cols, image.rows), kMarkColour, 2 * width - 1);
}
