// Outputs of networks: any tensor gives boxes, a surface, a field and curves without a fault.
#include "densepose/bundle/manifest.h"
#include "densepose/detector/proposals.h"
#include "densepose/detector/roi_align.h"
#include "densepose/surface/dense_decode.h"
#include "edges/curves/curve_extractor.h"
#include "edges/field_decode.h"
#include "edges/files/curve_files.h"
#include "edges/files/curve_json.h"
#include "edges/files/curve_step.h"
#include "edges/measuring/boxes.h"
#include "fuzz_target.h"
#include "image/crop_input.h"

using namespace maq;

namespace {

struct AnyCharts : ChartValues {
  ChartPoint at(int, int, int) override { return {numbers->take<float>(), numbers->take<float>()}; }
  fuzz::Numbers* numbers = nullptr;
};

void write_all(const EdgeCurves& curves) {
  curves_as_obj(curves);
  curves_as_ply(curves);
  curves_as_dxf(curves);
  curves_as_json(curves);
  curves_as_step(curves);
}

std::vector<fuzz::Bytes> curve_seeds() {
  fuzz::Writer seed;
  for (int type = 0; type < 3; ++type) {
    seed.within(type, 0).within(1, 0).within(1, 0).within(0, 0).within(1, 0).within(4, 2).within(5, 4);
    for (int i = 0; i < 60; ++i) seed.add(0.25 * i);
  }
  return {seed.bytes};
}

}  // namespace

FUZZ(boxes) {
  fuzz::Numbers numbers(bytes);
  RpnSpec spec;
  spec.strides = {4, 8};
  spec.anchor_sizes_px = {32, 64};
  spec.aspect_ratios = {0.5f, 1, 2};
  spec.pre_nms_top_k = numbers.within(1, 64);
  spec.nms_iou = 0.7f;
  std::vector<std::vector<float>> values;
  std::vector<RpnLevel> levels;
  for (size_t i = 0; i < 2; ++i) {
    RpnLevel level;
    level.width = numbers.within(1, 8);
    level.height = numbers.within(1, 8);
    values.push_back(numbers.floats(size_t(level.width) * size_t(level.height) * 15));
    levels.push_back(level);
  }
  for (size_t i = 0; i < 2; ++i) levels[i].values = values[i].data();
  std::vector<RpnCandidate> candidates;
  std::vector<ScoredBox> found;
  int dropped = 0;
  select_proposals(levels, spec, numbers.within(1, 32), 64, 48, candidates, found, &dropped);
  const std::vector<float> features(8 * 8 * 2, 0.5f);
  RoiAlign align;
  for (ScoredBox& scored : found) {
    const Box& box = scored.box;
    fuzz::require(box.x0 >= 0 && box.y0 >= 0 && box.x1 <= 64 && box.y1 <= 48 && box.area() > 0, "a box outside");
    std::vector<float> pooled(7 * 7 * 2);
    align.run({features.data(), 2, 8, 8, 8}, box, 7, pooled.data());
    const std::vector<float> deltas = numbers.floats(4);
    scored.box = apply_deltas(box, deltas.data(), {10, 10, 5, 5});
    if (!clip_box(scored.box, 64, 48)) scored.box = {};
  }
  non_maximum_suppression(found, 0.5f, 16);
}

FUZZ(surface) {
  fuzz::Numbers numbers(bytes);
  AnyCharts charts;
  charts.numbers = &numbers;
  DenseLogits logits;
  logits.coarse_classes = numbers.within(2, 15);
  logits.index_classes = 25;
  logits.size = 2 * numbers.within(1, 8);
  logits.charts = numbers.within(0, 1) == 0 ? nullptr : &charts;
  DensePlanes planes;
  planes.reset(numbers.within(1, 64), numbers.within(1, 64));
  Box box{numbers.take<float>(), numbers.take<float>(), numbers.take<float>(), numbers.take<float>()};
  // A rotation and a scaling, as crops of people have.
  const double angle_rad = double(numbers.take<int16_t>()) / 1000, scale = double(numbers.within(1, 10000)) / 100;
  AffineMap to_cells{scale * std::cos(angle_rad), -scale * std::sin(angle_rad), double(numbers.take<int32_t>()) / 256,
                     scale * std::sin(angle_rad), scale * std::cos(angle_rad),  double(numbers.take<int32_t>()) / 256};
  const std::vector<float> labels =
      numbers.floats(size_t(logits.size) * size_t(logits.size) * size_t(logits.coarse_classes + logits.index_classes));
  logits.labels = labels.data();
  DecodeMemory memory;
  classify_cells(logits, memory);
  part_confidence(logits, 0.5f, memory);
  if (clip_box(box, float(planes.width_px), float(planes.height_px))) {
    paint_person(logits, box, 1, 0.5f, 0.2f, memory, planes);
  }
  paint_rotated_person(logits, to_cells, 2, 0.5f, 0.2f, memory, planes);
  for (size_t i = 0; i < planes.part.size(); ++i) {
    fuzz::require(planes.part[i] <= 24 && planes.person[i] <= 2, "a part or person that is not there");
  }
  head_bounds(planes, 1);
}

FUZZ(edge_field) {
  fuzz::Numbers numbers(bytes);
  EdgeField field;
  field.width = 2 * numbers.within(1, 24);
  field.height = 2 * numbers.within(1, 24);
  field.eps_r = 16;
  field.intrinsics = {};
  field.intrinsics.width_px = field.width;
  field.intrinsics.height_px = field.height;
  field.intrinsics.fx_px = 1e-3 + std::abs(double(numbers.take<int32_t>()));
  field.intrinsics.fy_px = 1e-3 + std::abs(double(numbers.take<int32_t>()));
  field.intrinsics.cx_px = double(numbers.take<int32_t>());
  field.intrinsics.cy_px = double(numbers.take<int32_t>());
  const size_t pixels = size_t(field.width) * size_t(field.height);
  const std::vector<float> planes = numbers.floats(pixels / 4 * FieldDecode::kChannels);
  field.distance_r.resize(pixels);
  field.expected_error_r.resize(pixels);
  field.kind.resize(pixels);
  field.depth_m = numbers.floats(pixels);
  for (float& depth : field.depth_m) depth = std::isnormal(depth) ? std::abs(depth) : 0;
  static WorkerThreads threads(1);
  static FieldDecode decode;
  static CurveExtractor extractor;
  static BoxFinder finder;
  decode.write(planes.data(), {0, 0, field.width, field.height}, threads, field);
  for (size_t i = 0; i < pixels; ++i) {
    fuzz::require(field.distance_r[i] >= 0 && field.distance_r[i] <= field.eps_r, "a distance outside 0 to eps_r");
    fuzz::require(field.kind[i] <= kBoundaryEdge, "a kind that is not there");
  }
  const EdgeCurves& curves = extractor.extract(field);
  std::vector<MeasuredBox> found;
  finder.find(field, found);
  write_all(curves);
}

// Curves with any numbers, whose indices are right.
SEEDED_FUZZ(curve_files, curve_seeds) {
  fuzz::Numbers numbers(bytes);
  const auto vector = [&] { return Vec3{numbers.take<double>(), numbers.take<double>(), numbers.take<double>()}; };
  EdgeCurves curves;
  curves.corners.resize(size_t(numbers.within(0, 3)));
  for (EdgeCorner& corner : curves.corners) corner = {vector(), numbers.within(0, 9)};
  curves.curves.resize(size_t(numbers.within(0, 5)));
  for (EdgeCurve& curve : curves.curves) {
    curve.type = CurveType(numbers.within(0, 2));
    curve.kind = EdgeKind(numbers.within(1, 2));
    curve.convexity = Convexity(numbers.within(0, 2));
    curve.is_closed = numbers.within(0, 1) != 0;
    for (int& corner : curve.corner) corner = numbers.within(-1, int(curves.corners.size()) - 1);
    curve.length_m = numbers.take<double>();
    curve.centre = vector(), curve.x_axis = vector(), curve.y_axis = vector();
    curve.sweep_rad = numbers.take<double>();
    curve.first_point = int(curves.points.size());
    curve.point_count = curve.type == CurveType::kLine ? 2 : numbers.within(2, 8);
    for (int i = 0; i < curve.point_count; ++i) curves.points.push_back(vector());
    if (curve.type != CurveType::kSpline) continue;
    curve.first_control = int(curves.controls.size());
    curve.control_count = numbers.within(4, 9);
    for (int i = 0; i < curve.control_count; ++i) curves.controls.push_back(vector());
  }
  write_all(curves);
}
