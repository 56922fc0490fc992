// Finds the curves of a field and the boxes among them, and keeps the data for snapping.
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

// The curves and boxes of a field, which may outlive it.
struct FoundCurves {
  EdgeCurves curves;
  std::vector<MeasuredBox> boxes;
  EdgeField seen;  // camera and depth alone, for snapping
  float curves_ms = 0, boxes_ms = 0;
};

// Keeps memory from frame to frame. One thread at a time.
class CurveFinder {
 public:
  // Overwrites `found` and reuses its memory. Throws the errors of CurveExtractor.
  void find(const EdgeField& field, const CurveRequest& request, FoundCurves& found);

 private:
  std::optional<CurveExtractor> extractor_;
  CurveOptions options_;  // of the extractor
  BoxFinder box_finder_;
};

}  // namespace maq
