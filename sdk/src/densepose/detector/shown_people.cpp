#include "densepose/detector/shown_people.h"

#include <algorithm>

namespace maq {
namespace {

// As a fraction of the threshold.
constexpr float kKeptScore = 0.7f;

// Returns the bounding box of the mapped corners.
Box mapped(const Box& box, const AffineMap& map) {
  const Point first = map({box.x0, box.y0});
  Point low = first, high = first;
  for (const Point& corner : {map({box.x1, box.y0}), map({box.x0, box.y1}), map({box.x1, box.y1})}) {
    low = {std::min(low.x, corner.x), std::min(low.y, corner.y)};
    high = {std::max(high.x, corner.x), std::max(high.y, corner.y)};
  }
  return {float(low.x), float(low.y), float(high.x), float(high.y)};
}

}  // namespace

float kept_score(float threshold) { return kKeptScore * threshold; }

void mark_shown(const std::vector<Box>& shown, const AffineMap& to_image, float threshold,
                std::vector<ScoredBox>& found) {
  for (const Box& box : shown) {
    const auto is_there = [&](const ScoredBox& person) {
      return !person.was_shown && overlap(mapped(person.box, to_image), box) > kSamePersonIou;
    };
    const auto person = std::find_if(found.begin(), found.end(), is_there);
    if (person != found.end()) person->was_shown = true;
  }
  const auto is_new_and_unlikely = [&](const ScoredBox& person) {
    return !person.was_shown && person.score <= threshold;
  };
  found.erase(std::remove_if(found.begin(), found.end(), is_new_and_unlikely), found.end());
}

}  // namespace maq
