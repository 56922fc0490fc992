#include "output/novelty_image.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "output/frame_image.h"
#include "output/prediction_mark.h"

namespace {

constexpr int kMinWidth_px = 160, kMaxWidth_px = 640, kStrip_px = 64;
constexpr float kRedFrom_bits = 1, kRed_bits = 8;  // of a cell: where red begins, and where it is full
constexpr double kMinBits = 0.03, kMaxBits = 12;   // of the curve, logarithmic

// 0 to 1 from the bottom to the top of the strip.
double height_of(double bits) {
  return std::clamp(std::log(std::max(bits, kMinBits) / kMinBits) / std::log(kMaxBits / kMinBits), 0.0, 1.0);
}

void redden(const maq_novelty_score& score, const std::vector<float>& map, cv::Mat& image) {
  cv::Mat cells(score.rows, score.columns, CV_32F), redness;
  for (int i = 0; i < score.rows * score.columns; ++i) {
    cells.at<float>(i / score.columns, i % score.columns) =
        0.7f * std::clamp((map[size_t(i)] - kRedFrom_bits) / (kRed_bits - kRedFrom_bits), 0.0f, 1.0f);
  }
  cv::resize(cells, redness, image.size(), 0, 0, cv::INTER_LINEAR);
  image.forEach<cv::Vec3b>([&](cv::Vec3b& pixel, const int* at) {
    const float red = redness.at<float>(at[0], at[1]);
    pixel = cv::Vec3b(uint8_t(pixel[0] * (1 - red)), uint8_t(pixel[1] * (1 - red)),
                      uint8_t(pixel[2] * (1 - red) + 255 * red));
  });
}

}  // namespace

void NoveltyImage::draw_curve(cv::Mat& strip) const {
  for (const auto& [bits, text] : {std::pair{0.1, "0.1 bits"}, {1.0, "1 bit"}, {10.0, "10 bits"}}) {
    const int y = int((1 - height_of(bits)) * (strip.rows - 1));
    cv::line(strip, {0, y}, {strip.cols, y}, cv::Scalar(60, 60, 60));
    cv::putText(strip, text, {3, std::max(9, y - 2)}, cv::FONT_HERSHEY_SIMPLEX, 0.32, cv::Scalar(130, 130, 130));
  }
  const int step = std::max(1, strip.cols / 300);
  int x = strip.cols - 1 - step * int(scores_.size() - 1);
  bool is_line = false;  // the first frame of a stream is scored by another prior
  cv::Point before;
  for (const maq_novelty_score& score : scores_) {
    const cv::Point now(x, int((1 - height_of(double(score.bits))) * (strip.rows - 1)));
    if (score.is_event != 0) cv::line(strip, {x, 0}, {x, strip.rows}, cv::Scalar(60, 60, 230));
    if (is_line && score.is_stream_start == 0) cv::line(strip, before, now, cv::Scalar(230, 230, 230), 1, cv::LINE_AA);
    is_line = score.is_stream_start == 0;
    before = now;
    x += step;
  }
}

cv::Mat NoveltyImage::draw(const maquette::Frame& frame, const maquette::Frame& reconstruction,
                           const maq_novelty_score& score, const std::vector<float>& map) {
  cv::Mat left = image_of(frame), right = image_of(reconstruction);
  if (half_.empty()) {
    const int width = std::clamp(left.cols, kMinWidth_px, kMaxWidth_px) / 2 * 2;
    half_ = {width, std::clamp(int(std::lround(double(left.rows) * width / left.cols)), 2, 2 * width) / 2 * 2};
  }
  cv::resize(left, left, half_, 0, 0, cv::INTER_AREA);
  cv::resize(right, right, half_, 0, 0, cv::INTER_LINEAR);
  redden(score, map, left);
  char text[64];
  std::snprintf(text, sizeof text, "%.2f bits, x %.1f%s", double(score.bits), double(score.ratio),
                score.is_cut != 0 ? ", cut" : "");
  draw_caption(text, left);
  draw_caption("reconstruction", right);
  scores_.push_back(score);
  const int columns = 2 * half_.width;
  while (int(scores_.size()) * std::max(1, columns / 300) > columns) scores_.pop_front();
  cv::Mat all(half_.height + kStrip_px, columns, CV_8UC3, cv::Scalar(20, 20, 20));
  left.copyTo(all(cv::Rect({0, 0}, half_)));
  right.copyTo(all(cv::Rect({half_.width, 0}, half_)));
  cv::Mat strip = all(cv::Rect(0, half_.height, columns, kStrip_px));
  draw_curve(strip);
  if (score.is_event != 0) cv::rectangle(all, cv::Rect({0, 0}, half_), cv::Scalar(60, 60, 230), 5);
  return all;
}
