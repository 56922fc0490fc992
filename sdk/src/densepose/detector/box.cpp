#include "densepose/detector/box.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

const float kLargestLogSize = std::log(1000.0f / 16.0f);

}  // namespace

Box apply_deltas(const Box& box, const float deltas[4], const std::array<float, 4>& weights) {
  const float width = box.width();
  const float height = box.height();
  const float centre_x = box.x0 + 0.5f * width + deltas[0] / weights[0] * width;
  const float centre_y = box.y0 + 0.5f * height + deltas[1] / weights[1] * height;
  // Written so that NaN passes through: std::min would hide it.
  const float dw = deltas[2] / weights[2];
  const float dh = deltas[3] / weights[3];
  const float half_width = 0.5f * width * std::exp(dw > kLargestLogSize ? kLargestLogSize : dw);
  const float half_height = 0.5f * height * std::exp(dh > kLargestLogSize ? kLargestLogSize : dh);
  return {centre_x - half_width, centre_y - half_height, centre_x + half_width, centre_y + half_height};
}

bool clip_box(Box& box, float width, float height) {
  if (std::isnan(box.x0) || std::isnan(box.y0) || std::isnan(box.x1) || std::isnan(box.y1)) return false;
  box.x0 = std::clamp(box.x0, 0.0f, width);
  box.x1 = std::clamp(box.x1, 0.0f, width);
  box.y0 = std::clamp(box.y0, 0.0f, height);
  box.y1 = std::clamp(box.y1, 0.0f, height);
  return box.x1 > box.x0 && box.y1 > box.y0;
}

float overlap(const Box& a, const Box& b) {
  const float width = std::min(a.x1, b.x1) - std::max(a.x0, b.x0);
  const float height = std::min(a.y1, b.y1) - std::max(a.y0, b.y0);
  if (!(width > 0) || !(height > 0)) return 0;
  const float both = width * height;
  return both / (a.area() + b.area() - both);
}

bool comes_before(const ScoredBox& a, const ScoredBox& b) {
  return a.score != b.score ? a.score > b.score : a.index < b.index;
}

void non_maximum_suppression(std::vector<ScoredBox>& boxes, float iou, size_t limit) {
  std::sort(boxes.begin(), boxes.end(), comes_before);
  auto end = boxes.begin();  // of the kept boxes, which move to the front
  for (const ScoredBox& candidate : boxes) {
    if (size_t(end - boxes.begin()) == limit) break;
    const bool suppressed = std::any_of(
        boxes.begin(), end, [&](const ScoredBox& better) { return overlap(candidate.box, better.box) > iou; });
    if (!suppressed) *end++ = candidate;
  }
  boxes.erase(end, boxes.end());
}

}  // namespace maq
