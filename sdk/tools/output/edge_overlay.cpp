#include "output/edge_overlay.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace {

constexpr int kReadableSidePx = 900;
constexpr int kLargestEnlargement = 4;
constexpr float kLine_r = 1.5f;  // half the width of a line
const cv::Vec3f kCrease(60, 235, 255), kBoundary(255, 255, 255), kInk(30, 20, 20);

cv::Mat plane_of(const maquette::EdgesResult& result, int type, const void* values) {
  return cv::Mat(result.height_px(), result.width_px(), type, const_cast<void*>(values));
}

// Depths from the nearest to the farthest but for 2 % on either side, which may be faults of the sensor; inverse, since
// that is how precise they are.
cv::Mat depth_in_colours(const cv::Mat& depth_m) {
  std::vector<float> inverse;
  for (auto z = depth_m.begin<float>(); z != depth_m.end<float>(); ++z) {
    if (*z > 0) inverse.push_back(1 / *z);
  }
  cv::Mat level = cv::Mat::zeros(depth_m.size(), CV_8U), colours;
  if (inverse.empty()) return cv::Mat::zeros(depth_m.size(), CV_8UC3);
  std::sort(inverse.begin(), inverse.end());
  const float low = inverse[inverse.size() / 50], high = inverse[inverse.size() - 1 - inverse.size() / 50];
  const float scale = 255 / std::max(high - low, 1e-3f * high);
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      const float z = depth_m.at<float>(y, x);
      if (z > 0) level.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>((1 / z - low) * scale);
    }
  }
  cv::applyColorMap(level, colours, cv::COLORMAP_TURBO);
  return colours;
}

// As if light came from the upper left: how bright the surface is, from its slopes.
cv::Mat shading(const cv::Mat& depth_m, const maq_intrinsics& camera) {
  cv::Mat bright(depth_m.size(), CV_32F, cv::Scalar(0));
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      const float z = depth_m.at<float>(y, x);
      if (!(z > 0)) continue;
      const auto slope = [&](int dx, int dy, double focal_px) {
        if (x + dx >= depth_m.cols || y + dy >= depth_m.rows) return 0.0f;
        const float next = depth_m.at<float>(y + dy, x + dx);
        return next > 0 ? float(focal_px) * (z - next) / next : 0.0f;
      };
      const float across = slope(1, 0, camera.fx_px), down = slope(0, 1, camera.fy_px);
      const float facing = (1 + 0.5f * across + 0.7f * down) / std::sqrt(1 + across * across + down * down);
      bright.at<float>(y, x) = std::clamp(0.45f + 0.4f * facing, 0.25f, 1.0f);
    }
  }
  return bright;
}

}  // namespace

cv::Mat draw_edge_overlay(const maquette::EdgesResult& result) {
  const cv::Mat depth_m = plane_of(result, CV_32F, result.depth_m());
  const cv::Mat bright = shading(depth_m, result.field().intrinsics);
  cv::Mat picture = depth_in_colours(depth_m);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) picture.at<cv::Vec3b>(y, x) *= bright.at<float>(y, x);
  }
  const int scale = std::clamp(kReadableSidePx / std::max(picture.cols, picture.rows), 1, kLargestEnlargement);
  const cv::Size size = picture.size() * scale;
  cv::Mat canvas, distance, kind;
  cv::resize(picture, canvas, size, 0, 0, cv::INTER_NEAREST);
  cv::resize(plane_of(result, CV_32F, result.distance_r()), distance, size, 0, 0, cv::INTER_LINEAR);
  cv::resize(plane_of(result, CV_8U, result.kind()), kind, size, 0, 0, cv::INTER_NEAREST);
  for (int y = 0; y < canvas.rows; ++y) {
    for (int x = 0; x < canvas.cols; ++x) {
      const uint8_t which = kind.at<uint8_t>(y, x);
      if (which == MAQ_EDGE_NONE) continue;
      const float from_r = distance.at<float>(y, x);
      cv::Vec3b& pixel = canvas.at<cv::Vec3b>(y, x);
      const auto mix = [&](const cv::Vec3f& colour, float amount) {
        pixel = cv::Vec3b(cv::Vec3f(pixel) + (colour - cv::Vec3f(pixel)) * std::clamp(amount, 0.0f, 1.0f));
      };
      mix(kInk, 0.5f * (2 - from_r / kLine_r));
      mix(which == MAQ_EDGE_CREASE ? kCrease : kBoundary, 2 * (1.25f - from_r / kLine_r));
    }
  }
  return canvas;
}
