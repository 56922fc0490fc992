// Boxes: deltas, clipping, overlap and non-maximum suppression.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace maq {

// Left, top, right, bottom; the right and bottom edges are exclusive.
struct Box {
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  float width() const { return x1 - x0; }
  float height() const { return y1 - y0; }
  float area() const { return width() * height(); }
};

// Deltas relative to a box (R-CNN): the centre moves by dx widths and dy heights, the size grows by exp(dw), exp(dh).
// Each is divided by its weight first; dw and dh are clamped at log(1000/16). NaN in gives NaN out.
Box apply_deltas(const Box& box, const float deltas[4], const std::array<float, 4>& weights);

// Clips to [0, width] x [0, height]. Returns false if the rest is NaN or has no area: such a box is dropped.
bool clip_box(Box& box, float width, float height);

// Intersection over union; 0 for boxes without area.
float overlap(const Box& a, const Box& b);
// Two boxes of one person, from two inputs or two frames, overlap by more.
constexpr float kSamePersonIou = 0.5f;

// A candidate of NMS. `index` breaks ties: of equal scores the lowest comes first.
struct ScoredBox {
  Box box;
  float score = 0;
  int64_t index = 0;
  bool was_shown = false;  // in a stream: at the place of a person of the previous frame
};

// Best score first, then lowest index: the order of everything that follows.
bool comes_before(const ScoredBox& a, const ScoredBox& b);

// Greedy non-maximum suppression, in place: keeps a box unless it overlaps a kept one by more than `iou`, at most
// `limit` boxes, in order. `boxes` need not be sorted.
void non_maximum_suppression(std::vector<ScoredBox>& boxes, float iou, size_t limit);

}  // namespace maq
