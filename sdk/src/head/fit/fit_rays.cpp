#include "head/fit/fit_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maq::head {
namespace {

constexpr double kHead = 0.5, kInner = 0.9;  // of a matte; beyond this, no background shows through
constexpr double kMaxSpread_dm = 0.25;       // of the template points of neighbours on one surface
constexpr int kHeldOutCells = 3;             // cells in a side of a held-out square

uint64_t mixed(uint64_t z) {  // SplitMix64
  z += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

// Which cells lie within `margin` of one of the head.
std::vector<char> near_head(const HeadObservations& seen, int margin) {
  const int side = seen.side;
  std::vector<char> rows(seen.cells.size()), near(seen.cells.size());
  const auto spread = [&](const auto& from, std::vector<char>& to, int along, int across) {
    for (int line = 0; line < side; ++line) {
      int last = -1 - margin;
      const auto visit = [&](int i) {
        const size_t index = size_t(line * across + i * along);
        if (from(index)) last = i;
        if (std::abs(i - last) <= margin) to[index] = 1;
      };
      for (int i = 0; i < side; ++i) visit(i);
      last = side + margin;
      for (int i = side; i-- > 0;) visit(i);
    }
  };
  spread([&](size_t i) { return seen.cells[i].is_usable && seen.cells[i].matte > kHead; }, rows, 1, side);
  spread([&](size_t i) { return rows[i] != 0; }, near, side, 1);
  return near;
}

// Four cells around a place, and how much of each; continuous coordinates in cells.
struct Between {
  const HeadCell* cells[4];
  double weights[4];
};

Between cells_around(const HeadObservations& seen, double x, double y) {
  const double column = std::clamp(x - 0.5, 0.0, seen.side - 1.0), row = std::clamp(y - 0.5, 0.0, seen.side - 1.0);
  const int left = std::min(int(column), std::max(seen.side - 2, 0));
  const int top = std::min(int(row), std::max(seen.side - 2, 0));
  const int right = std::min(left + 1, seen.side - 1), bottom = std::min(top + 1, seen.side - 1);
  const double u = column - left, v = row - top;
  const auto cell = [&](int i, int j) { return &seen.cells[size_t(i) * size_t(seen.side) + size_t(j)]; };
  return {{cell(top, left), cell(top, right), cell(bottom, left), cell(bottom, right)},
          {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v}};
}

void observe(const Between& between, FitRay& ray) {
  bool is_known = true, is_head = true;
  double matte = 0, sigma = 0;
  Vec3 point;
  for (int k = 0; k < 4; ++k) {
    const HeadCell& cell = *between.cells[k];
    const double weight = between.weights[k];
    is_known = is_known && cell.is_usable;
    is_head = is_head && cell.is_usable && cell.matte > kHead &&
              length(cell.template_point - between.cells[0]->template_point) <= kMaxSpread_dm;
    matte += weight * cell.matte;
    sigma += weight * cell.sigma_dm;
    point = point + weight * cell.template_point;
  }
  ray.matte = is_known ? float(matte) : std::numeric_limits<float>::quiet_NaN();
  ray.has_point = is_head;
  if (!is_head) return;
  ray.point[0] = float(point.x), ray.point[1] = float(point.y), ray.point[2] = float(point.z);
  ray.point_sigma_dm = float(sigma);
}

// The mean of the crop's pixels in a square of it; false where one of them has no colour.
bool mean_colour(const HeadPhoto& photo, double left, double top, double size, float* rgb) {
  const int side = photo.rgb_side;
  double sums[3] = {}, area = 0;
  for (int y = std::max(0, int(top)); y < std::min(side, int(std::ceil(top + size))); ++y) {
    const double tall = std::min(y + 1.0, top + size) - std::max(double(y), top);
    for (int x = std::max(0, int(left)); x < std::min(side, int(std::ceil(left + size))); ++x) {
      const double part = tall * (std::min(x + 1.0, left + size) - std::max(double(x), left));
      if (!(part > 0)) continue;
      const float* from = photo.rgb.data() + (size_t(y) * size_t(side) + size_t(x)) * 3;
      area += part;
      for (size_t c = 0; c < 3; ++c) sums[c] += part * double(from[c]);
    }
  }
  for (size_t c = 0; c < 3; ++c) rgb[c] = float(sums[c] / (255 * area));
  return area > 0 && std::all_of(rgb, rgb + 3, [](float value) { return value >= 0 && value <= 1; });
}

}  // namespace

void add_fit_rays(const HeadPhoto& photo, uint32_t index, const FitRayOptions& options, FitRays& rays) {
  const HeadObservations& seen = photo.seen;
  const int side = options.side_px;
  const double cells_a_pixel = double(seen.side) / side;
  const double crop_side = seen.side * seen.cell_px;  // in the photo's pixels
  rays.cells_per_ray = cells_a_pixel * cells_a_pixel;
  const std::vector<char> near = near_head(seen, options.margin_cells);
  const bool has_rgb = photo.rgb_side > 0 && photo.rgb.size() == 3 * size_t(photo.rgb_side) * size_t(photo.rgb_side);
  const double scale =
      std::sqrt(seen.crop_to_photo.xx * seen.crop_to_photo.yy - seen.crop_to_photo.xy * seen.crop_to_photo.yx);
  const double crop_px = crop_side / scale;  // a row of the crop, in its own pixels
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const double x = (column + 0.5) * cells_a_pixel, y = (row + 0.5) * cells_a_pixel;
      const int cell_x = int(x), cell_y = int(y);
      if (!near[size_t(cell_y) * size_t(seen.side) + size_t(cell_x)]) continue;
      FitRay ray;
      ray.photo = index;
      const Point at = seen.crop_to_photo({x / seen.side * crop_px, y / seen.side * crop_px});
      const bool is_inside = (photo.width_px <= 0 || (at.x >= 0 && at.x < photo.width_px)) &&
                             (photo.height_px <= 0 || (at.y >= 0 && at.y < photo.height_px));
      if (!is_inside) continue;
      ray.x_px = float(at.x - 0.5 - photo.cx_px), ray.y_px = float(at.y - 0.5 - photo.cy_px);
      observe(cells_around(seen, x, y), ray);
      if (has_rgb && ray.matte > kInner) {
        const double size = double(photo.rgb_side) / side;
        ray.has_colour = mean_colour(photo, column * size, row * size, size, ray.rgb);
      }
      const uint64_t square = uint64_t(cell_y / kHeldOutCells) << 40 | uint64_t(cell_x / kHeldOutCells) << 20 | index;
      const bool is_held_out =
          double(mixed(square + mixed(options.seed)) >> 11) < options.held_out_fraction * 9007199254740992.0;
      (is_held_out ? rays.held_out : rays.fitted).push_back(ray);
    }
  }
}

}  // namespace maq::head
