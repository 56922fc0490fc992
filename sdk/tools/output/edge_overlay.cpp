#include "output/edge_overlay.h"

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
const cv::Scalar kConvexLine(60, 235, 255), kConcaveLine(90, 255, 90), kBoundaryLine(255, 255, 255), kDark(20, 15, 15),
    kCorner(80, 80, 255), kBox(255, 120, 255);
constexpr int kSubpixelBits = 4;

cv::Mat plane_of(const maquette::EdgesResult& result, int type, const void* values) {
  return cv::Mat(result.height_px(), result.width_px(), type, const_cast<void*>(values));
}

// Depths from the nearest to the farthest but for 2 % on either side, which may be faults of the sensor; inverse, since
// that is how precise they are.
cv::Mat depth_in_colours(const cv::Mat& depth_m) {
  std::vector<float> inverse;
  for (auto z = depth_m.begin<float>(); z != depth_m.end<float>(); ++z) {
    if (*z > 0) inverse.push_back(1 / *z);
  }
  cv::Mat level = cv::Mat::zeros(depth_m.size(), CV_8U), colours;
  if (inverse.empty()) return cv::Mat::zeros(depth_m.size(), CV_8UC3);
  std::sort(inverse.begin(), inverse.end());
  const float low = inverse[inverse.size() / 50], high = inverse[inverse.size() - 1 - inverse.size() / 50];
  const float scale = 255 / std::max(high - low, 1e-3f * high);
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      const float z = depth_m.at<float>(y, x);
      if (z > 0) level.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>((1 / z - low) * scale);
    }
  }
  cv::applyColorMap(level, colours, cv::COLORMAP_TURBO);
  return colours;
}

// As if light came from the upper left: how bright the surface is, from its slopes.
cv::Mat shading(const cv::Mat& depth_m, const maq_intrinsics& camera) {
  cv::Mat bright(depth_m.size(), CV_32F, cv::Scalar(0));
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      const float z = depth_m.at<float>(y, x);
      if (!(z > 0)) continue;
      const auto slope = [&](int dx, int dy, double focal_px) {
        if (x + dx >= depth_m.cols || y + dy >= depth_m.rows) return 0.0f;
        const float next = depth_m.at<float>(y + dy, x + dx);
        return next > 0 ? float(focal_px) * (z - next) / next : 0.0f;
      };
      const float across = slope(1, 0, camera.fx_px), down = slope(0, 1, camera.fy_px);
      const float facing = (1 + 0.5f * across + 0.7f * down) / std::sqrt(1 + across * across + down * down);
      bright.at<float>(y, x) = std::clamp(0.45f + 0.4f * facing, 0.25f, 1.0f);
    }
  }
  return bright;
}

// Draws what is in space onto the enlarged picture.
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

  // Its outline, or each length at that of the four edges which is nearest.
  void box(const maq_edges_box& box, bool is_outline) {
    for (size_t axis = 0; axis < 3; ++axis) {
      const size_t others[] = {(axis + 1) % 3, (axis + 2) % 3};
      cv::Vec3d nearest(0, 0, INFINITY);
      for (int which = 0; which < 4; ++which) {
        cv::Vec3d middle(box.centre_m);
        const cv::Vec3d half = cv::Vec3d(box.axes[axis]) * (0.5 * box.size_m[axis]);
        for (size_t k = 0; k < 2; ++k) {
          middle += cv::Vec3d(box.axes[others[k]]) * ((which >> k & 1 ? 0.5 : -0.5) * box.size_m[others[k]]);
        }
        const cv::Vec3d ends[] = {middle - half, middle + half};  // six doubles
        if (is_outline) polyline(ends[0].val, 2, kBox, 1);
        if (middle[2] < nearest[2]) nearest = middle;
      }
      if (!is_outline && nearest[2] > 0) label(nearest.val, cv::format("%.0f", 1e3 * box.size_m[axis]));
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

  // Pixels of the field are squares of `scale` pixels; what is far outside of the picture is drawn no farther.
  cv::Point fixed(const double* p) const {
    const auto at = [&](double focal, double along, double centre, int side) {
      const double px = ((focal * along / p[2] + centre + 0.5) * scale_ - 0.5);
      return int(std::lround(std::clamp(px, -4.0 * side, 5.0 * side) * (1 << kSubpixelBits)));
    };
    return {at(camera_.fx_px, p[0], camera_.cx_px, canvas_.cols), at(camera_.fy_px, p[1], camera_.cy_px, canvas_.rows)};
  }

  cv::Mat& canvas_;
  const maq_intrinsics& camera_;
  int scale_;
};

}  // namespace

cv::Mat draw_edge_overlay(const maquette::EdgesResult& result, const std::vector<maq_edges_curve>& curves,
                          const std::vector<maq_edges_corner>& corners, const std::vector<maq_edges_box>& boxes) {
  const cv::Mat depth_m = plane_of(result, CV_32F, result.depth_m());
  const cv::Mat bright = shading(depth_m, result.field().intrinsics);
  cv::Mat picture = depth_in_colours(depth_m);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) picture.at<cv::Vec3b>(y, x) *= bright.at<float>(y, x);
  }
  const int scale = std::clamp(kReadableSidePx / std::max(picture.cols, picture.rows), 1, kLargestEnlargement);
  const cv::Size size = picture.size() * scale;
  cv::Mat canvas, distance, kind;
  cv::resize(picture, canvas, size, 0, 0, cv::INTER_NEAREST);
  cv::resize(plane_of(result, CV_32F, result.distance_r()), distance, size, 0, 0, cv::INTER_LINEAR);
  cv::resize(plane_of(result, CV_8U, result.kind()), kind, size, 0, 0, cv::INTER_NEAREST);
  for (int y = 0; y < canvas.rows; ++y) {
    for (int x = 0; x < canvas.cols; ++x) {
      const uint8_t which = kind.at<uint8_t>(y, x);
      if (which == MAQ_EDGE_NONE) continue;
      const float from_r = distance.at<float>(y, x);
      cv::Vec3b& pixel = canvas.at<cv::Vec3b>(y, x);
      const auto mix = [&](const cv::Vec3f& colour, float amount) {
        pixel = cv::Vec3b(cv::Vec3f(pixel) + (colour - cv::Vec3f(pixel)) * std::clamp(amount, 0.0f, 1.0f));
      };
      const float strength = curves.empty() ? 1 : kFieldStrength;
      mix(kInk, strength * 0.5f * (2 - from_r / kLine_r));
      mix(which == MAQ_EDGE_CREASE ? kCrease : kBoundary,
          strength * std::clamp(2 * (1.25f - from_r / kLine_r), 0.0f, 1.0f));
    }
  }
  Drawing drawing(canvas, result.field().intrinsics, scale);
  for (const maq_edges_box& box : boxes) drawing.box(box, true);
  for (const maq_edges_curve& curve : curves) {
    const cv::Scalar& colour = curve.kind == MAQ_EDGE_BOUNDARY       ? kBoundaryLine
                               : curve.bend == MAQ_EDGE_BEND_CONCAVE ? kConcaveLine
                                                                     : kConvexLine;
    drawing.curve(curve.points_m, curve.point_count, colour);
  }
  for (const maq_edges_corner& corner : corners) drawing.dot(corner.point_m, kCorner, 3);
  for (const maq_edges_box& box : boxes) drawing.box(box, false);
  return canvas;
}
