#include "densepose/proposals.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr std::array<float, 4> kUnitWeights = {1, 1, 1, 1};

struct Candidate {
  float logit;
  int32_t index;  // (y * width + x) * anchors + anchor
};

// The `count` best logits of a level in order; NaN and infinities never get in.
std::vector<Candidate> best_candidates(const RpnLevel& level, int anchors, int count, int* dropped) {
  const int cells = level.width * level.height;
  std::vector<Candidate> candidates;
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
  const auto comes_before = [](const Candidate& a, const Candidate& b) {
    return a.logit != b.logit ? a.logit > b.logit : a.index < b.index;
  };
  // Finding the best and then sorting them is several times as fast as std::partial_sort here.
  if (candidates.size() > size_t(count)) {
    std::nth_element(candidates.begin(), candidates.begin() + count, candidates.end(), comes_before);
    candidates.resize(size_t(count));
  }
  std::sort(candidates.begin(), candidates.end(), comes_before);
  return candidates;
}

}  // namespace

Box anchor_box(int x, int y, int stride, float size_px, float ratio) {
  const float width = size_px / std::sqrt(ratio);
  const float height = size_px * std::sqrt(ratio);
  const float centre_x = float(x * stride);
  const float centre_y = float(y * stride);
  return {centre_x - 0.5f * width, centre_y - 0.5f * height, centre_x + 0.5f * width, centre_y + 0.5f * height};
}

std::vector<ScoredBox> select_proposals(const std::vector<RpnLevel>& levels, const RpnSpec& spec, float width,
                                        float height, int* dropped) {
  const int anchors = int(spec.aspect_ratios.size());
  std::vector<ScoredBox> all;
  for (size_t l = 0; l < levels.size(); ++l) {
    const RpnLevel& level = levels[l];
    // Greedy suppression in order of score, so that boxes are only made of candidates until enough are kept.
    std::vector<ScoredBox> kept;
    for (const Candidate& candidate : best_candidates(level, anchors, spec.pre_nms_top_k, dropped)) {
      if (kept.size() == size_t(spec.post_nms_top_k)) break;
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
      const bool suppressed = std::any_of(
          kept.begin(), kept.end(), [&](const ScoredBox& better) { return overlap(box, better.box) > spec.nms_iou; });
      if (!suppressed) kept.push_back({box, candidate.logit, int64_t(l) << 32 | candidate.index});
    }
    all.insert(all.end(), kept.begin(), kept.end());
  }
  std::sort(all.begin(), all.end(), comes_before);
  if (all.size() > size_t(spec.post_nms_top_k)) all.resize(size_t(spec.post_nms_top_k));
  return all;
}

}  // namespace maq
