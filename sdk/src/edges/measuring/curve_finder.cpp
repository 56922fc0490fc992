#include "edges/measuring/curve_finder.h"

#include "core/clock.h"

namespace maq {

void CurveFinder::find(const EdgeField& field, const CurveRequest& request, FoundCurves& found) {
  Stopwatch stage;
  if (!extractor_ || !(options_ == request.options)) {
    extractor_.emplace(request.options);
    options_ = request.options;
  }
  found.curves = extractor_->extract(field);
  found.curves_ms = float(stage.lap_ms());
  found.boxes.clear();
  if (request.finds_boxes) box_finder_.find(field, found.curves, found.boxes);
  found.boxes_ms = request.finds_boxes ? float(stage.lap_ms()) : 0;
  found.seen.width = field.width;
  found.seen.height = field.height;
  found.seen.intrinsics = field.intrinsics;
  found.seen.depth_m = field.depth_m;
}

}  // namespace maq
