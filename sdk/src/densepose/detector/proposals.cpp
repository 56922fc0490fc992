#include "densepose/detector/proposals.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr std::array<float, 4> kUnitWeights = {1, 1, 1, 1};

// The `count` best logits of a level in order; without NaN and infinities.
void best_candidates(const RpnLevel& level, int anchors, int count, std::vector<RpnCandidate>& candidates,
                     int* dropped) {
  const int cells = level.width * level.height;
  candidates.clear();
  candidates.reserve(size_t(cells) * size_t(anchors));
  for (int cell = 0; cell < cells; ++cell) {
    for (int anchor = 0; anchor < anchors; ++anchor) {
      const float logit = level.values[size_t(cell) * size_t(5 * anchors) + size_t(anchor)];
      if (!std::isfinite(logit)) {
        ++*dropped;
      } else {
        candidates.push_back({logit, int32_t(cell * anchors + anchor)});
      }
    }
  }
  const auto comes_before = [](const RpnCandidate& a, const RpnCandidate& b) {
    return a.logit != b.logit ? a.logit > b.logit : a.index < b.index;
  };
  // Finding the best and then sorting them is several times as fast as std::partial_sort here.
  if (candidates.size() > size_t(count)) {
    std::nth_element(candidates.begin(), candidates.begin() + count, candidates.end(), comes_before);
    candidates.resize(size_t(count));
  }
  std::sort(candidates.begin(), candidates.end(), comes_before);
}

}  // namespace

Box anchor_box(int x, int y, int stride, float size_px, float ratio) {
  const float width = size_px / std::sqrt(ratio);
  const float height = size_px * std::sqrt(ratio);
  const float centre_x = float(x * stride);
  const float centre_y = float(y * stride);
  return {centre_x - 0.5f * width, centre_y - 0.5f * height, centre_x + 0.5f * width, centre_y + 0.5f * height};
}

void select_proposals(const std::vector<RpnLevel>& levels, const RpnSpec& spec, int max_proposals, float width,
                      float height, std::vector<RpnCandidate>& candidates, std::vector<ScoredBox>& found,
                      int* dropped) {
  const int anchors = int(spec.aspect_ratios.size());
  found.clear();
  for (size_t l = 0; l < levels.size(); ++l) {
    const RpnLevel& level = levels[l];
    // Greedy suppression in order of score, so that boxes are only made of candidates until enough are kept.
    best_candidates(level, anchors, spec.pre_nms_top_k, candidates, dropped);
    const size_t before = found.size();
    for (const RpnCandidate& candidate : candidates) {
      if (found.size() - before == size_t(max_proposals)) break;
      const int anchor = candidate.index % anchors;
      const int cell = candidate.index / anchors;
      const float* deltas = level.values + size_t(cell) * size_t(5 * anchors) + size_t(anchors + 4 * anchor);
      Box box = apply_deltas(anchor_box(cell % level.width, cell / level.width, spec.strides[l],
                                        spec.anchor_sizes_px[l], spec.aspect_ratios[size_t(anchor)]),
                             deltas, kUnitWeights);
      if (!clip_box(box, width, height)) {
        ++*dropped;
        continue;
      }
      const bool suppressed =
          std::any_of(found.begin() + std::ptrdiff_t(before), found.end(),
                      [&](const ScoredBox& better) { return overlap(box, better.box) > spec.nms_iou; });
      if (!suppressed) found.push_back({box, candidate.logit, int64_t(l) << 32 | candidate.index});
    }
  }
  std::sort(found.begin(), found.end(), comes_before);
  if (found.size() > size_t(max_proposals)) found.resize(size_t(max_proposals));
}

}  // namespace maq
