#include "output/edge_overlay.h"

#include <app/edge_picture.h>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace {

constexpr int kReadableSidePx = 900;
constexpr int kLargestEnlargement = 4;
constexpr float kLine_r = 1.5f;         // half the width of a line
constexpr float kFieldStrength = 0.4f;  // under curves
const cv::Vec3f kCrease(60, 235, 255), kBoundary(255, 255, 255), kInk(30, 20, 20);
const cv::Scalar kDark(20, 15, 15);
constexpr int kSubpixelBits = 4;

cv::Mat plane_of(const maquette::EdgesResult& result, int type, const void* values) {
  return cv::Mat(result.height_px(), result.width_px(), type, const_cast<void*>(values));
}

cv::Scalar bgr(const maquette::Rgb& colour) { return {double(colour.b), double(colour.g), double(colour.r)}; }

// Draws what is in space onto the enlarged image.
class Drawing {
 public:
  Drawing(cv::Mat& canvas, const maq_intrinsics& camera, int scale) : canvas_(canvas), camera_(camera), scale_(scale) {}

  void curve(const double* points_m, size_t count, const cv::Scalar& colour) {
    polyline(points_m, count, kDark, 4);
    polyline(points_m, count, colour, 2);
  }

  void polyline(const double* points_m, size_t count, const cv::Scalar& colour, int width) {
    std::vector<cv::Point> line;
    for (size_t i = 0; i < count; ++i) {
      if (points_m[3 * i + 2] > 0) line.push_back(fixed(points_m + 3 * i));
    }
    cv::polylines(canvas_, line, false, colour, width, cv::LINE_AA, kSubpixelBits);
  }

  void dot(const double* point_m, const cv::Scalar& colour, int radius) {
    if (!(point_m[2] > 0)) return;
    cv::circle(canvas_, fixed(point_m), (radius + 1) << kSubpixelBits, kDark, cv::FILLED, cv::LINE_AA, kSubpixelBits);
    cv::circle(canvas_, fixed(point_m), radius << kSubpixelBits, colour, cv::FILLED, cv::LINE_AA, kSubpixelBits);
  }

  void outline(const maquette::BoxLines& lines) {
    for (const auto& edge : lines.edges) polyline(edge[0].data(), 2, bgr(maquette::kBoxColour), 1);  // six doubles
  }

  void lengths(const maquette::BoxLines& lines, const maq_edges_box& box) {
    for (size_t axis = 0; axis < 3; ++axis) {
      const double* const at = lines.labels[axis].data();
      if (at[2] > 0) label(at, cv::format("%.0f", 1e3 * box.size_m[axis]));
    }
  }

 private:
  void label(const double* point_m, const std::string& text) {
    const double size = std::max(0.5, canvas_.cols / 1400.0);
    int baseline = 0;
    const cv::Size box = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, size, 2, &baseline);
    const cv::Point at = fixed(point_m) / (1 << kSubpixelBits) + cv::Point(-box.width / 2, box.height / 2);
    cv::putText(canvas_, text, at, cv::FONT_HERSHEY_SIMPLEX, size, kDark, 5, cv::LINE_AA);
    cv::putText(canvas_, text, at, cv::FONT_HERSHEY_SIMPLEX, size, cv::Scalar::all(255), 2, cv::LINE_AA);
  }

  // Pixels of the field are squares of `scale` pixels; what is far outside of the image is drawn no farther.
  cv::Point fixed(const double* p) const {
    const auto at = [&](double field_px, int side) {
      const double px = (field_px + 0.5) * scale_ - 0.5;
      return int(std::lround(std::clamp(px, -4.0 * side, 5.0 * side) * (1 << kSubpixelBits)));
    };
    const maquette::Pixel seen = maquette::pixel_of(camera_, p);
    return {at(seen[0], canvas_.cols), at(seen[1], canvas_.rows)};
  }

  cv::Mat& canvas_;
  const maq_intrinsics& camera_;
  int scale_;
};

}  // namespace

cv::Mat draw_edge_overlay(const maquette::EdgesResult& result, const std::vector<maq_edges_curve>& curves,
                          const std::vector<maq_edges_corner>& corners, const std::vector<maq_edges_box>& boxes) {
  maquette::RgbaImage layer;
  maquette::draw_edge_layer(result, maquette::EdgeLayer::kDepth, &layer);
  cv::Mat picture;
  cv::cvtColor(plane_of(result, CV_8UC4, layer.rgba.data()), picture, cv::COLOR_RGBA2BGR);
  const int scale = std::clamp(kReadableSidePx / std::max(picture.cols, picture.rows), 1, kLargestEnlargement);
  const cv::Size size = picture.size() * scale;
  cv::Mat canvas, distance, kind;
  cv::resize(picture, canvas, size, 0, 0, cv::INTER_NEAREST);
  cv::resize(plane_of(result, CV_32F, result.distance_r()), distance, size, 0, 0, cv::INTER_LINEAR);
  cv::resize(plane_of(result, CV_8U, result.kind()), kind, size, 0, 0, cv::INTER_NEAREST);
  for (int y = 0; y < canvas.rows; ++y) {
    for (int x = 0; x < canvas.cols; ++x) {
      const uint8_t which = kind.at<uint8_t>(y, x);
      if (which == MAQ_EDGES_KIND_NONE) continue;
      const float from_r = distance.at<float>(y, x);
      cv::Vec3b& pixel = canvas.at<cv::Vec3b>(y, x);
      const auto mix = [&](const cv::Vec3f& colour, float amount) {
        pixel = cv::Vec3b(cv::Vec3f(pixel) + (colour - cv::Vec3f(pixel)) * std::clamp(amount, 0.0f, 1.0f));
      };
      const float strength = curves.empty() ? 1 : kFieldStrength;
      mix(kInk, strength * 0.5f * (2 - from_r / kLine_r));
      mix(which == MAQ_EDGES_KIND_CREASE ? kCrease : kBoundary,
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
