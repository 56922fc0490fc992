#include "edges/fusion/fusion_view.h"

#include <algorithm>
#include <cmath>

#include "edges/curves/edge_curves.h"

namespace maq {
namespace {

// On a surface tilted by 75 degrees depth changes by 4 r from pixel to pixel. A larger change means another surface.
constexpr double kSteepest_r = 4;
// A distance beyond this fraction of eps_r only means that no edge is near.
constexpr double kFar = 0.9;
// Minimum weight of the pixels that see the point, of the four pixels around it: the weight of the nearest.
constexpr double kMinWeight = 0.25;

}  // namespace

FusionView::FusionView(const EdgeField& field, const PinholeCamera& pose)
    : camera_(pose), focal_px_(maq::focal_px(pose)), eps_r_(field.eps_r) {
  const size_t pixels = size_t(camera_.width_px) * size_t(camera_.height_px);
  depth_m_.resize(pixels);
  distance_.resize(pixels);
  std::vector<float> known;
  for (size_t i = 0; i < pixels; ++i) {
    const float z = field.depth_m[i];
    depth_m_[i] = std::isfinite(z) && z > 0 ? z : 0;
    if (depth_m_[i] > 0) known.push_back(z);
    const double share = double(field.distance_r[i]) / eps_r_;  // NaN becomes 1 below
    distance_[i] = uint16_t(std::nearbyint((share >= 0 ? std::min(share, 1.0) : share < 0 ? 0.0 : 1.0) * kSteps));
  }
  known_pixels_ = int64_t(known.size());
  if (known.empty()) return;
  const auto middle = known.begin() + std::ptrdiff_t(known.size() / 2);
  std::nth_element(known.begin(), middle, known.end());
  median_depth_m_ = *middle;
}

Vec3 FusionView::point(int x, int y) const {
  const double z = depth(x, y);
  return {z * (x - camera_.cx_px) / camera_.fx_px, z * (y - camera_.cy_px) / camera_.fy_px, z};
}

Vec3 FusionView::normal(int x, int y) const {
  const Vec3 here = point(x, y), view = normalized(-here);
  const double w = 1 / here.z;
  double n = 0, sx = 0, sy = 0, xx = 0, xy = 0, yy = 0, b = 0, bx = 0, by = 0;
  for (int dy = -kNormalWindow_px; dy <= kNormalWindow_px; ++dy) {
    if (y + dy < 0 || y + dy >= camera_.height_px) continue;
    for (int dx = -kNormalWindow_px; dx <= kNormalWindow_px; ++dx) {
      if (x + dx < 0 || x + dx >= camera_.width_px) continue;
      const double z = depth(x + dx, y + dy);
      if (!(z > 0)) continue;
      const double other = 1 / z, d = other - w;
      if (!(std::abs(d) * focal_px_ <= other * kSteepest_r * (std::abs(dx) + std::abs(dy)))) continue;
      n += 1, sx += dx, sy += dy;
      xx += dx * dx, xy += dx * dy, yy += dy * dy;
      b += d, bx += d * dx, by += d * dy;
    }
  }
  xx -= sx * sx / n, xy -= sx * sy / n, yy -= sy * sy / n, bx -= sx * b / n, by -= sy * b / n;
  const double det = xx * yy - xy * xy;
  if (!(det > 1e-6 * xx * yy)) return view;
  const double slope_x = (bx * yy - by * xy) / det, slope_y = (by * xx - bx * xy) / det;
  // Inverse depth with these slopes is the plane slope_x fx X + slope_y fy Y + at_axis Z = 1.
  const double at_axis =
      w + (b - slope_x * sx - slope_y * sy) / n + slope_x * (camera_.cx_px - x) + slope_y * (camera_.cy_px - y);
  const Vec3 normal = normalized({-slope_x * camera_.fx_px, -slope_y * camera_.fy_px, -at_axis});
  return dot(normal, view) > 0 ? normal : view;
}

double FusionView::distance_m(Vec3 at, double r_m, double reach_r) const {
  constexpr double kUnseen = -1;
  if (!(at.z > 0)) return kUnseen;
  double x = at.x / at.z * camera_.fx_px + camera_.cx_px, y = at.y / at.z * camera_.fy_px + camera_.cy_px;
  const int width = camera_.width_px, height = camera_.height_px;
  if (!(x >= -0.5 && y >= -0.5 && x <= width - 0.5 && y <= height - 0.5)) return kUnseen;
  x = std::clamp(x, 0.0, width - 1.0);
  y = std::clamp(y, 0.0, height - 1.0);
  const int left = std::min(int(x), std::max(width - 2, 0)), top = std::min(int(y), std::max(height - 2, 0));
  const double u = x - left, v = y - top;
  double distance = 0, depth_here = 0, total = 0;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const int column = std::min(left + dx, width - 1), row = std::min(top + dy, height - 1);
      const Vec3 p = point(column, row), away = p - at;
      const double reach_m = reach_r * p.z / focal_px_;
      if (!(p.z > 0 && dot(away, away) <= reach_m * reach_m)) continue;
      const double weight = (dx != 0 ? u : 1 - u) * (dy != 0 ? v : 1 - v);
      distance += weight * distance_r(size_t(row) * size_t(width) + size_t(column));
      depth_here += weight * p.z;
      total += weight;
    }
  }
  if (!(total >= kMinWeight)) return kUnseen;
  distance /= total;
  depth_here /= total;
  const double most = eps_r_ * r_m;
  return distance > kFar * eps_r_ ? most : std::min(distance * depth_here / focal_px_, most);
}

Vec3 FusionView::to_camera(Vec3 d) const {
  const auto& r = camera_.rotation;
  return {r[0] * d.x + r[1] * d.y + r[2] * d.z, r[3] * d.x + r[4] * d.y + r[5] * d.z,
          r[6] * d.x + r[7] * d.y + r[8] * d.z};
}

Vec3 FusionView::to_world(Vec3 d) const {
  const auto& r = camera_.rotation;
  return {r[0] * d.x + r[3] * d.y + r[6] * d.z, r[1] * d.x + r[4] * d.y + r[7] * d.z,
          r[2] * d.x + r[5] * d.y + r[8] * d.z};
}

}  // namespace maq
