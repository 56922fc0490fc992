#include "app/edges_frame.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace maquette {
namespace {

double distance_to_segment(const Pixel& p, const Pixel& a, const Pixel& b) {
  const double along[] = {b[0] - a[0], b[1] - a[1]}, from[] = {p[0] - a[0], p[1] - a[1]};
  const double square = along[0] * along[0] + along[1] * along[1];
  const double t = square > 0 ? std::clamp((along[0] * from[0] + along[1] * from[1]) / square, 0.0, 1.0) : 0;
  return std::hypot(from[0] - t * along[0], from[1] - t * along[1]);
}

}  // namespace

void EdgesFrame::take(PipelineResult from, double rate, EdgeLayer of_layer) {
  curves.clear(), corners.clear(), boxes.clear();
  curves_stats = {};
  result = std::make_shared<EdgesResult>(std::move(*edges_of(from)));
  std::optional<EdgesCurves> found_curves = curves_of(from);
  found = found_curves ? std::make_shared<EdgesCurves>(std::move(*found_curves)) : nullptr;
  if (found != nullptr) {
    curves = found->curves();
    corners = found->corners();
    boxes = found->boxes();
    curves_stats = found->stats();
  }
  stats = result->stats();
  layer = of_layer;
  const auto before = std::chrono::steady_clock::now();
  draw_edge_layer(*result, layer, &picture);
  drawing_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - before).count();
  waiting_ms = from.wait_ms;
  age_ms = from.age_ms;
  results_per_second = rate;
  number = from.number;
}

EdgesPick EdgesFrame::pick(double x_px, double y_px, double radius_px) const {
  EdgesPick pick;
  pick.snap.index = -1;
  if (found == nullptr) return pick;
  pick.snap = found->snap_to_pixel(x_px, y_px, radius_px);
  const maq_intrinsics& camera = result->field().intrinsics;
  pick.curve_away_px = radius_px;
  for (size_t i = 0; i < curves.size(); ++i) {
    const double* point = curves[i].points_m;
    for (uint32_t k = 1; k < curves[i].point_count; ++k, point += 3) {
      if (!(point[2] > 0 && point[5] > 0)) continue;
      const double away = distance_to_segment({x_px, y_px}, pixel_of(camera, point), pixel_of(camera, point + 3));
      if (away <= pick.curve_away_px) pick.curve = int(i), pick.curve_away_px = away;
    }
  }
  return pick;
}

}  // namespace maquette
