// Measures the conversion and resizing of a frame of 640 x 480 beside OpenCV on one thread: the minimum of many runs,
// which alternate.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <opencv2/imgproc.hpp>

#include "image/convert.h"
#include "image/geometry/resize.h"

namespace {

constexpr int kWidth = 640, kHeight = 480, kRuns = 400;

double milliseconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

void compare(const char* name, const std::function<void()>& ours, const std::function<void()>& opencv) {
  double ours_ms = 1e9, opencv_ms = 1e9;
  for (int i = 0; i < kRuns; ++i) {
    ours_ms = std::min(ours_ms, milliseconds(ours));
    opencv_ms = std::min(opencv_ms, milliseconds(opencv));
  }
  std::printf("{\"kernel\": \"%s\", \"ms\": %.3f, \"opencv_ms\": %.3f}\n", name, ours_ms, opencv_ms);
}

void compare_conversion(const char* name, maq_pixel_format format, int rows, int type, int code) {
  cv::Mat from(rows, kWidth, type), expected;
  cv::randu(from, 0, 256);
  maq::ImageView image{format, kWidth, kHeight, {{from.data, from.step}, {}}};
  if (format == MAQ_PIXEL_NV12) image.planes[1] = {from.ptr(kHeight), from.step};
  std::vector<uint8_t> memory;
  compare(
      name, [&] { maq::as_bgr(image, memory); }, [&] { cv::cvtColor(from, expected, code); });
}

void compare_resizing(const char* name, int width, int height, int interpolation) {
  cv::Mat from(kHeight, kWidth, CV_8UC3), expected, to(height, width, CV_8UC3);
  cv::randu(from, 0, 256);
  compare(
      name,
      [&] {
        maq::resize({from.data, from.step, kWidth, kHeight, 3}, {to.data, to.step, width, height, 3});
      },
      [&] { cv::resize(from, expected, to.size(), 0, 0, interpolation); });
}

}  // namespace

int main() {
  cv::setNumThreads(1);
  compare_conversion("RGB to BGR", MAQ_PIXEL_RGB8, kHeight, CV_8UC3, cv::COLOR_RGB2BGR);
  compare_conversion("NV12 to BGR", MAQ_PIXEL_NV12, kHeight * 3 / 2, CV_8UC1, cv::COLOR_YUV2BGR_NV12);
  compare_conversion("YUYV to BGR", MAQ_PIXEL_YUYV, kHeight, CV_8UC2, cv::COLOR_YUV2BGR_YUYV);
  compare_resizing("halve", kWidth / 2, kHeight / 2, cv::INTER_AREA);
  compare_resizing("shrink to 416 x 312", 416, 312, cv::INTER_AREA);
  compare_resizing("enlarge to 1280 x 960", 2 * kWidth, 2 * kHeight, cv::INTER_LINEAR);
}
