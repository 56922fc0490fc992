#pragma once

#include <optional>

#include "api/handle.h"
#include "edges/curves/curve_extractor.h"
#include "edges/edges.h"
#include "edges/measuring/boxes.h"
#include "maquette/edge_curves.h"

namespace maq {

// The bundle that a config without one means.
inline constexpr char kEdgesBundle[] = "edges-int8";

// The caller's config on top of the defaults; NULL means the defaults. `name` begins error texts.
maq_edges_config read_edges_config(const maq_edges_config* given, const char* name);

// Throws ArgumentError for what is out of range; `name` is that of the config.
EdgesSettings edges_settings(const maq_edges_config& config, const char* name);

// What maq_edges_curves_config has, checked; `name` begins error texts.
struct CurveRequest {
  CurveOptions options;
  bool finds_boxes = true;
};
CurveRequest curve_request(const maq_edges_curves_config* given, const char* name);

}  // namespace maq

// Curves stay what they are while the app has them, so that all threads may read them.
struct maq_edges_curves : maq::HandleOf<maq::HandleKind::kEdgesCurves> {
  // Memory is kept for the next time.
  void find(const maq::EdgeField& field, const maq::CurveRequest& request);

  const maq::EdgeCurves* found = nullptr;  // of the extractor, after find()
  std::vector<maq::MeasuredBox> boxes;
  maq::EdgeField seen;  // camera and depth alone, for snapping
  float curves_ms = 0, boxes_ms = 0;
  maq::BoundedPool<maq_edges_curves>::Deleter deleter;

 private:
  std::optional<maq::CurveExtractor> extractor_;
  maq::CurveOptions options_;  // of the extractor
  maq::BoxFinder box_finder_;
};

struct maq_edges_result : maq::HandleOf<maq::HandleKind::kEdgesResult> {
  maq::EdgesResult result;
  std::optional<maq::BoundedPool<maq_edges_curves>> curves;  // lends what is found in it
  maq::BoundedPool<maq_edges_result>::Deleter deleter;
};

struct maq_edges : maq::HandleOf<maq::HandleKind::kEdges> {
  maq_edges(std::shared_ptr<maq::ContextState> of, std::unique_ptr<maq::Edges> made, size_t pool_size)
      : state(std::move(of)), edges(std::move(made)), results(pool_size, "results"), curves(pool_size, "curves") {}
  std::shared_ptr<maq::ContextState> state;
  std::unique_ptr<maq::Edges> edges;
  maq::BoundedPool<maq_edges_result> results;
  maq::BoundedPool<maq_edges_curves> curves;
};
