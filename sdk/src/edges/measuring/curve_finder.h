// What an app asks of a field at once: its curves, the boxes among them, and what a pointer snaps to.
#pragma once

#include <optional>
#include <vector>

#include "edges/curves/curve_extractor.h"
#include "edges/measuring/boxes.h"

namespace maq {

struct CurveRequest {
  CurveOptions options;
  bool finds_boxes = true;
};

// Kept apart from the field that they were found in.
struct FoundCurves {
  EdgeCurves curves;
  std::vector<MeasuredBox> boxes;
  EdgeField seen;  // camera and depth alone, for snapping
  float curves_ms = 0, boxes_ms = 0;
};

// Keeps memory from frame to frame. Not for two threads at once.
class CurveFinder {
 public:
  // `found` is overwritten and its memory reused. Throws what CurveExtractor throws.
  void find(const EdgeField& field, const CurveRequest& request, FoundCurves& found);

 private:
  std::optional<CurveExtractor> extractor_;
  CurveOptions options_;  // of the extractor
  BoxFinder box_finder_;
};

}  // namespace maq
