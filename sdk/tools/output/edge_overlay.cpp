#include "output/edge_overlay.h"

#include <app/edge_picture.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace {

constexpr int kReadableSidePx = 900;
constexpr int kLargestEnlargement = 4;
constexpr float kLine_r = 1.5f;         // half the width of a line
constexpr float kFieldStrength = 0.4f;  // under curves
constexpr Bgr kCrease = {60, 235, 255}, kBoundary = {255, 255, 255}, kInk = {30, 20, 20}, kDark = {20, 15, 15};

constexpr Bgr bgr(const maquette::Rgb& colour) { return {colour.b, colour.g, colour.r}; }

// Draws what is in space onto the enlarged image.
class Drawing {
 public:
  Drawing(Canvas& canvas, const maq_intrinsics& camera, int scale) : canvas_(canvas), camera_(camera), scale_(scale) {}

  void curve(const double* points_m, size_t count, Bgr colour) {
    polyline(points_m, count, kDark, 4);
    polyline(points_m, count, colour, 2);
  }

  void polyline(const double* points_m, size_t count, Bgr colour, int width) {
    const double* before = nullptr;
    for (const double* point = points_m; point < points_m + 3 * count; point += 3) {
      if (!(point[2] > 0)) continue;
      if (before != nullptr) canvas_.line(seen(before), seen(point), width, colour);
      before = point;
    }
  }

  void dot(const double* point_m, Bgr colour, int radius) {
    if (!(point_m[2] > 0)) return;
    canvas_.disc(seen(point_m), radius + 1, kDark);
    canvas_.disc(seen(point_m), radius, colour);
  }

  void outline(const maquette::BoxLines& lines) {
    for (const auto& edge : lines.edges) polyline(edge[0].data(), 2, bgr(maquette::kBoxColour), 1);  // six doubles
  }

  void lengths(const maquette::BoxLines& lines, const maq_edges_box& box) {
    for (size_t axis = 0; axis < 3; ++axis) {
      const double* const at = lines.labels[axis].data();
      char text[32];
      std::snprintf(text, sizeof text, "%.0f", 1e3 * box.size_m[axis]);
      if (at[2] > 0) label(at, text);
    }
  }

 private:
  void label(const double* point_m, const std::string& text) {
    const int point_px = std::max(2, canvas_.width() / 500);
    const PictureSide size = Canvas::text_size(text, point_px);
    const CanvasPoint middle = seen(point_m);
    const int x = int(middle.x) - size.width / 2, y = int(middle.y) - size.height / 2;
    for (int dy = -2; dy <= 2; ++dy) {
      for (int dx = -2; dx <= 2; ++dx) canvas_.text(text, x + dx, y + dy, point_px, kDark);
    }
    canvas_.text(text, x, y, point_px, {255, 255, 255});
  }

  // Pixels of the field are squares of `scale` pixels; what is far outside of the image is drawn no farther.
  CanvasPoint seen(const double* p) const {
    const auto at = [&](double field_px, int side) {
      return std::clamp((field_px + 0.5) * scale_ - 0.5, -4.0 * side, 5.0 * side);
    };
    const maquette::Pixel pixel = maquette::pixel_of(camera_, p);
    return {at(pixel[0], canvas_.width()), at(pixel[1], canvas_.height())};
  }

  Canvas& canvas_;
  const maq_intrinsics& camera_;
  int scale_;
};

}  // namespace

Canvas draw_edge_overlay(const maquette::EdgesResult& result, const std::vector<maq_edges_curve>& curves,
                         const std::vector<maq_edges_corner>& corners, const std::vector<maq_edges_box>& boxes) {
  maquette::RgbaImage layer;
  maquette::draw_edge_layer(result, maquette::EdgeLayer::kDepth, &layer);
  const PictureSide field{result.width_px(), result.height_px()};
  const int scale = std::clamp(kReadableSidePx / std::max(field.width, field.height), 1, kLargestEnlargement);
  Canvas canvas({field.width * scale, field.height * scale});
  FloatPlane distance(field);
  std::copy_n(result.distance_r(), distance.values.size(), distance.values.begin());
  distance = distance.resized(canvas.size());
  for (int y = 0; y < canvas.height(); ++y) {
    for (int x = 0; x < canvas.width(); ++x) {
      const size_t at = size_t(y / scale) * size_t(field.width) + size_t(x / scale);
      for (size_t c = 0; c < 3; ++c) canvas.at(x, y)[c] = layer.rgba[4 * at + 2 - c];
      const uint8_t which = result.kind()[at];
      if (which == MAQ_EDGES_KIND_NONE) continue;
      const float from_r = distance.at(x, y), strength = curves.empty() ? 1 : kFieldStrength;
      canvas.mix(x, y, kInk, std::clamp(strength * 0.5f * (2 - from_r / kLine_r), 0.0f, 1.0f));
      canvas.mix(x, y, which == MAQ_EDGES_KIND_CREASE ? kCrease : kBoundary,
                 strength * std::clamp(2 * (1.25f - from_r / kLine_r), 0.0f, 1.0f));
    }
  }
  Drawing drawing(canvas, result.field().intrinsics, scale);
  for (const maq_edges_box& box : boxes) drawing.outline(maquette::lines_of(box));
  for (const maq_edges_curve& curve : curves) {
    const auto group = size_t(maquette::group_of(curve));
    drawing.curve(curve.points_m, curve.point_count, bgr(maquette::kEdgeGroupColours[group]));
  }
  for (const maq_edges_corner& corner : corners) drawing.dot(corner.point_m, bgr(maquette::kCornerColour), 3);
  for (const maq_edges_box& box : boxes) drawing.lengths(maquette::lines_of(box), box);
  return canvas;
}
