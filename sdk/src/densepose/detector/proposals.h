// Proposals of the detector (region proposal network): anchors, their deltas, top-k and NMS.
#pragma once

#include <cstdint>
#include <vector>

#include "densepose/bundle/manifest.h"
#include "densepose/detector/box.h"

namespace maq {

// The detector's output at one level of the pyramid.
struct RpnLevel {
  // [height, width, 5 * anchors]: a logit for each anchor, then dx, dy, dw, dh for each.
  const float* values = nullptr;
  int width = 0;
  int height = 0;
};

struct RpnCandidate {
  float logit;
  int32_t index;  // (y * width + x) * anchors + anchor
};

// The anchor of a cell: centred on (x, y) * stride, of area size^2 and height / width = ratio.
Box anchor_box(int x, int y, int stride, float size_px, float ratio);

// The at most `max_proposals` best boxes over all levels, best first, clipped to the image (`width` x `height`, pixels
// of the network's input without padding). Each level keeps its pre_nms_top_k best, then NMS runs within each level;
// ties go to the lower level, then to the lowest (y, x, anchor). Boxes with NaN or infinite numbers or without area are
// left out, and counted in `dropped` as far as they were examined before enough were found. They go to `found`; the
// memory of `candidates` is reused.
void select_proposals(const std::vector<RpnLevel>& levels, const RpnSpec& spec, int max_proposals, float width,
                      float height, std::vector<RpnCandidate>& candidates, std::vector<ScoredBox>& found, int* dropped);

}  // namespace maq
