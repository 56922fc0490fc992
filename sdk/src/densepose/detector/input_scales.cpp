#include "densepose/detector/input_scales.h"

#include <algorithm>

namespace maq {
namespace {

constexpr int kFarSidePx = 480;
// The larger input is worth its time if it is larger by this factor.
constexpr double kMinGrowth = 1.25;
// Long sides of a person's box in the smaller input. Smaller people need the larger input; a stream leaves it when
// nobody is smaller than the second value. People who are larger than the third are never taken from the larger input.
constexpr float kSmallPx = 100, kNoLongerSmallPx = 110, kMaxFarPx = 160;
// A box that lies in another one by this fraction of its area, and has a long side shorter by that factor, shows a
// part of the other person.
constexpr float kInside = 0.8f, kPartOfPerson = 0.5f;
// At the larger input, people with a longer long side, as a fraction of the input's, may be missed.
constexpr float kLargeInFar = 0.6f;
// Key frames of a stream between looks at the other input.
constexpr int kEmptyFrames = 8, kFarFrames = 16;

float long_side(const Box& box) { return std::max(box.width(), box.height()); }

float smallest(const std::vector<ScoredBox>& people) {
  float side = 1e9f;
  for (const ScoredBox& person : people) side = std::min(side, long_side(person.box));
  return side;
}

bool is_part_of(const Box& box, const Box& person) {
  const float width = std::min(box.x1, person.x1) - std::max(box.x0, person.x0);
  const float height = std::min(box.y1, person.y1) - std::max(box.y0, person.y0);
  return width > 0 && height > 0 && width * height > kInside * box.area() &&
         long_side(box) < kPartOfPerson * long_side(person);
}

Box scaled(const Box& box, float by) { return {box.x0 * by, box.y0 * by, box.x1 * by, box.y1 * by}; }

}  // namespace

int InputScales::far_side_px(int image_long_side_px, int min_person_px) const {
  if (float(min_person_px) * float(near_side_px_) >= kSmallPx * float(image_long_side_px)) return 0;
  const int side = std::min(kFarSidePx, image_long_side_px);
  return side >= kMinGrowth * near_side_px_ ? side : 0;
}

bool InputScales::runs_far(const std::vector<ScoredBox>& people) {
  if (!is_stream_) return people.empty() || smallest(people) < kSmallPx;
  if (is_far_) return true;
  if (!people.empty()) {
    empty_frames_ = 0;
    return smallest(people) < kSmallPx;
  }
  return empty_frames_++ % kEmptyFrames == 0;
}

void InputScales::judge(const std::vector<ScoredBox>& people, bool ran_near) {
  if (!is_stream_) return;
  const bool is_small = !people.empty() && smallest(people) < (is_far_ ? kNoLongerSmallPx : kSmallPx);
  const float largest_px = kLargeInFar * float(near_side_px_);
  const bool has_large = std::any_of(people.begin(), people.end(),
                                     [=](const ScoredBox& person) { return long_side(person.box) > largest_px; });
  if (ran_near) far_frames_ = 0;
  is_far_ = is_small || !ran_near;  // what the larger input says alone is checked before it is left
  checks_near_ = !is_small || has_large || ++far_frames_ >= kFarFrames;
}

void InputScales::reset() {
  is_far_ = checks_near_ = false;
  empty_frames_ = far_frames_ = 0;
}

void select_people(const std::vector<ScoredBox>& near_people, const std::vector<ScoredBox>& far_people, float to_near,
                   std::vector<uint8_t>& keeps_near, std::vector<uint8_t>& keeps_far) {
  keeps_near.assign(near_people.size(), 1);
  keeps_far.assign(far_people.size(), 1);
  for (size_t f = 0; f < far_people.size(); ++f) {
    const Box box = scaled(far_people[f].box, to_near);
    size_t same = near_people.size();
    float most = kSamePersonIou;
    bool is_part = false;
    for (size_t n = 0; n < near_people.size(); ++n) {
      const Box& other = near_people[n].box;
      const float iou = overlap(box, other);
      if (iou > most) most = iou, same = n;
      is_part = is_part || is_part_of(box, other);
    }
    if (same == near_people.size()) {
      keeps_far[f] = !is_part && long_side(box) < kMaxFarPx;
    } else if (long_side(near_people[same].box) < kSmallPx && keeps_near[same] != 0) {
      keeps_near[same] = 0;
    } else {
      keeps_far[f] = 0;
    }
  }
}

}  // namespace maq
