#pragma once

#include <optional>
#include <vector>

#include "api/handle.h"
#include "edges/curves/curve_extractor.h"
#include "edges/edges.h"
#include "edges/measuring/boxes.h"
#include "maquette/edge_curves.h"

namespace maq {

// The default bundle.
inline constexpr char kEdgesBundle[] = "edges-int8";

// Returns the caller's config, or the defaults for NULL. `name` begins error texts.
maq_edges_config read_edges_config(const maq_edges_config* given, const char* name);

// Throws ArgumentError for a value out of range. `name` is the name of the config.
EdgesSettings edges_settings(const maq_edges_config& config, const char* name);

// Returns the number of results that the app may hold at once.
uint32_t result_pool_size_of(const maq_edges_config& config);

struct CurveRequest {
  CurveOptions options;
  bool finds_boxes = true;
  double focal_tolerance = 0;  // 0: unknown
};

// The curves and boxes of a field, which may outlive it.
struct FoundCurves {
  EdgeCurves curves;
  std::vector<MeasuredBox> boxes;
  EdgeField seen;  // camera and depth alone, for snapping
  float curves_ms = 0, boxes_ms = 0;
  bool includes_focal_tolerance = false;
};

// Finds curves and boxes. Keeps memory from frame to frame. One thread at a time.
class CurveFinder {
 public:
  // Overwrites `found` and reuses its memory. Throws the errors of CurveExtractor.
  void find(const EdgeField& field, const CurveRequest& request, FoundCurves& found);

 private:
  CurveExtractor extractor_;
  BoxFinder box_finder_;
};

// Checks a config and converts it to a request; `name` begins error texts.
CurveRequest curve_request(const maq_edges_curves_config* given, const char* name);

}  // namespace maq

// Curves do not change while the app holds them, so that all threads may read them.
struct maq_edges_curves : maq::HandleOf<maq::HandleKind::kEdgesCurves> {
  maq::FoundCurves found;
  maq::CurveFinder finder;
  maq::BoundedPool<maq_edges_curves>::Deleter deleter;
};

struct maq_edges_result : maq::HandleOf<maq::HandleKind::kEdgesResult> {
  maq::EdgesResult result;
  std::optional<maq::BoundedPool<maq_edges_curves>> curves;  // lends the curves that are found in it
  maq::BoundedPool<maq_edges_result>::Deleter deleter;
};

struct maq_edges : maq::HandleOf<maq::HandleKind::kEdges> {
  maq_edges(std::shared_ptr<maq::ContextState> of, std::unique_ptr<maq::Edges> made, size_t pool_size)
      : state(std::move(of)), edges(std::move(made)), results(pool_size, "results"), curves(pool_size, "curves") {}
  std::shared_ptr<maq::ContextState> state;
  std::unique_ptr<maq::Edges> edges;
  bool has_warned_of_unit = false;
  maq::BoundedPool<maq_edges_result> results;
  maq::BoundedPool<maq_edges_curves> curves;
};
