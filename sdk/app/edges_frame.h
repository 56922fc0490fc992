// The edges of a frame for display in a window: a layer as an image, curves, corners, boxes, and the target of a
// pointer.
#pragma once

#include <maquette/maquette.hpp>
#include <memory>
#include <vector>

#include "app/edge_picture.h"

namespace maquette {

// The target at a pixel.
struct EdgesPick {
  maq_edges_snap snap{};     // a corner, a curve, or a plane adjacent to a curve
  int curve = -1;            // the nearest curve within the radius, -1: none
  double curve_away_px = 0;  // how far from the pixel it is
};

struct EdgesFrame {
  RgbaImage picture;
  EdgeLayer layer = EdgeLayer::kDepth;        // that the image is of
  std::shared_ptr<const EdgesResult> result;  // null before the first frame
  std::shared_ptr<const EdgesCurves> found;   // null where curves were not asked for; the others then are empty
  std::vector<maq_edges_curve> curves;        // their pointers are of `found`
  std::vector<maq_edges_corner> corners;
  std::vector<maq_edges_box> boxes;
  maq_edges_stats stats{};
  maq_edges_curves_stats curves_stats{};
  double drawing_ms = 0, waiting_ms = 0, age_ms = -1, results_per_second = 0;
  uint64_t number = 0;  // 0: none yet

  // Takes a result of a pipeline that finds edges.
  void take(PipelineResult from, double rate, EdgeLayer of_layer);
  // At a pixel of the field, which may be any place. Nothing where no curves were found.
  EdgesPick pick(double x_px, double y_px, double radius_px) const;
};

}  // namespace maquette
