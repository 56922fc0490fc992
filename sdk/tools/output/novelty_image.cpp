#include "output/novelty_image.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "output/frame_image.h"
#include "output/prediction_mark.h"
#include "output/sampled_frames.h"

namespace {

constexpr int kMinWidth_px = 160, kMaxWidth_px = 640, kStrip_px = 64;
constexpr float kRedFrom_bits = 1, kRed_bits = 8;  // of a cell: where red begins, and where it is full
constexpr Bgr kEvent = {60, 60, 230};
constexpr double kMinBits = 0.03, kMaxBits = 12;  // of the curve, logarithmic

// 0 to 1 from the bottom to the top of the strip.
double height_of(double bits) {
  return std::clamp(std::log(std::max(bits, kMinBits) / kMinBits) / std::log(kMaxBits / kMinBits), 0.0, 1.0);
}

FloatPlane redness_of(const maq_novelty_score& score, const std::vector<float>& map) {
  FloatPlane cells({score.columns, score.rows});
  for (size_t i = 0; i < cells.values.size(); ++i) {
    cells.values[i] = 0.7f * std::clamp((map[i] - kRedFrom_bits) / (kRed_bits - kRedFrom_bits), 0.0f, 1.0f);
  }
  return cells;
}

}  // namespace

void NoveltyImage::draw_curve(Canvas& strip) const {
  const double bottom = strip.height() - 1;
  for (const auto& [bits, text] : {std::pair{0.1, "0.1 bits"}, {1.0, "1 bit"}, {10.0, "10 bits"}}) {
    const int y = int((1 - height_of(bits)) * bottom);
    strip.fill(0, y, {strip.width(), 1}, {60, 60, 60});
    strip.text(text, 3, std::max(1, y - 9), 1, {130, 130, 130});
  }
  const int step = std::max(1, strip.width() / 300);
  int x = strip.width() - 1 - step * int(scores_.size() - 1);
  bool is_line = false;  // the first frame of a stream is scored by another prior
  CanvasPoint before;
  for (const maq_novelty_score& score : scores_) {
    const CanvasPoint now{double(x), (1 - height_of(double(score.bits))) * bottom};
    if (score.is_event != 0) strip.fill(x, 0, {1, strip.height()}, kEvent);
    if (is_line && score.is_stream_start == 0) strip.line(before, now, 1, {230, 230, 230});
    is_line = score.is_stream_start == 0;
    before = now;
    x += step;
  }
}

Canvas NoveltyImage::draw(const maquette::Frame& frame, const maquette::Frame& reconstruction,
                          const maq_novelty_score& score, const std::vector<float>& map) {
  if (half_.width == 0) {
    const maq_frame_desc desc = frame.desc();
    const int width = std::clamp(desc.width_px, kMinWidth_px, kMaxWidth_px) / 2 * 2;
    half_ = {width, std::clamp(int(std::lround(double(desc.height_px) * width / desc.width_px)), 2, 2 * width) / 2 * 2};
  }
  Canvas left = image_of(frame).resized(half_), right = image_of(reconstruction).resized(half_);
  redden(redness_of(score, map), left);
  char text[64];
  std::snprintf(text, sizeof text, "%.2f bits, x %.1f%s", double(score.bits), double(score.ratio),
                score.is_cut != 0 ? ", cut" : "");
  draw_caption(text, left);
  draw_caption("reconstruction", right);
  scores_.push_back(score);
  const int columns = 2 * half_.width;
  while (int(scores_.size()) * std::max(1, columns / 300) > columns) scores_.pop_front();
  Canvas all({columns, half_.height + kStrip_px}), strip({columns, kStrip_px}, {20, 20, 20});
  draw_curve(strip);
  if (score.is_event != 0) left.outline({2, 2}, {half_.width - 3.0, half_.height - 3.0}, 5, kEvent);
  all.copy(left, 0, 0);
  all.copy(right, half_.width, 0);
  all.copy(strip, 0, half_.height);
  return all;
}
