#include "densepose/crops/person_crop.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace maq {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kContext = 1.15;  // the crop's side over the long side of the person's box
// Counts of cells of the dense head; fewer give no direction.
constexpr int kMinTorsoCells = 16, kMinHeadCells = 6;
constexpr double kMinAgreement = 0.1;  // length of the sum of two unit vectors
// The smallest fraction of torso in the person's cells that gives a direction.
constexpr double kMinTorsoFraction = 0.15;
// In a stream a smaller change of the axis leaves the crop's rotation. The axis of a first answer is off by 8.5 degrees
// in the median, and the networks know people who lean by 20.
constexpr double kSteadyDegrees = 15;

// Parts count from 0 here, as in DecodeMemory.
bool is_torso(int part) { return part == 0 || part == 1; }
bool is_head(int part) { return part == 22 || part == 23; }

Point unit(const Point& vector) {
  const double length = std::max(std::hypot(vector.x, vector.y), 1e-9);
  return {vector.x / length, vector.y / length};
}

// The mean of positions, and the sums for the slope of a value over them.
class SlopeFit {
 public:
  void add(const Point& at, double value) {
    ++count_;
    x_ += at.x, y_ += at.y, value_ += value;
    xx_ += at.x * at.x, xy_ += at.x * at.y, yy_ += at.y * at.y;
    x_value_ += at.x * value, y_value_ += at.y * value;
  }

  int count() const { return count_; }
  Point mean() const { return {x_ / count_, y_ / count_}; }

  // Least squares; (0, 0) if all positions lie on one line.
  Point slope() const {
    const double xx = xx_ - x_ * x_ / count_, xy = xy_ - x_ * y_ / count_, yy = yy_ - y_ * y_ / count_;
    const double xv = x_value_ - x_ * value_ / count_, yv = y_value_ - y_ * value_ / count_;
    const double determinant = xx * yy - xy * xy;
    if (!(determinant > 1e-6 * xx * yy)) return {};
    return {(yy * xv - xy * yv) / determinant, (xx * yv - xy * xv) / determinant};
  }

 private:
  int count_ = 0;
  double x_ = 0, y_ = 0, value_ = 0, xx_ = 0, xy_ = 0, yy_ = 0, x_value_ = 0, y_value_ = 0;
};

struct Bounds {
  Point low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};

  void add(const Point& at) {
    low = {std::min(low.x, at.x), std::min(low.y, at.y)};
    high = {std::max(high.x, at.x), std::max(high.y, at.y)};
  }
};

// Bounds of the cells that show the person, mapped by `map`; of all cells if none does.
Bounds bounds_of_person(int size, const AffineMap& map, float mask_threshold, const DecodeMemory& memory) {
  const float min_odds = min_log_odds(mask_threshold);
  Bounds bounds;
  for (int row = 0; row < size; ++row) {
    const float* const odds = memory.odds.data() + size_t(row) * size_t(size);
    int first = 0, end = size;
    while (first < end && !(odds[first] > min_odds)) ++first;
    while (end > first && !(odds[end - 1] > min_odds)) --end;
    if (first == end) continue;
    for (const int column : {first, end}) {
      bounds.add(map({double(column), double(row)}));
      bounds.add(map({double(column), double(row + 1)}));
    }
  }
  if (bounds.low.x <= bounds.high.x) return bounds;
  for (const int column : {0, size}) {
    for (const int row : {0, size}) bounds.add(map({double(column), double(row)}));
  }
  return bounds;
}

}  // namespace

AffineMap PersonCrop::to_cells(int cells) const {
  const double scale_x = cells / double(box.width()), scale_y = cells / double(box.height());
  AffineMap map = to_crop;
  map.xx *= scale_x, map.xy *= scale_x, map.shift_x = (map.shift_x - double(box.x0)) * scale_x;
  map.yx *= scale_y, map.yy *= scale_y, map.shift_y = (map.shift_y - double(box.y0)) * scale_y;
  return map;
}

Point PersonCrop::up() const { return unit({-to_image.xy, -to_image.yy}); }

OpenSides open_sides(int size, float mask_threshold, const DecodeMemory& memory) {
  const float min_odds = min_log_odds(mask_threshold);
  const auto shows = [&](int row, int column) {
    return memory.odds[size_t(row) * size_t(size) + size_t(column)] > min_odds;
  };
  OpenSides open;
  for (int i = 0; i < size; ++i) {
    open.left = open.left || shows(i, 0);
    open.right = open.right || shows(i, size - 1);
    open.top = open.top || shows(0, i);
    open.bottom = open.bottom || shows(size - 1, i);
  }
  return open;
}

AffineMap map_of_cells(const Box& box, int cells) {
  AffineMap map;
  map.xx = double(box.width()) / cells, map.shift_x = double(box.x0);
  map.yy = double(box.height()) / cells, map.shift_y = double(box.y0);
  return map;
}

std::optional<Point> find_body_axis(const DenseLogits& logits, const AffineMap& cells_to_image, float mask_threshold,
                                    const DecodeMemory& memory) {
  const float min_odds = min_log_odds(mask_threshold);
  SlopeFit torso, head;
  int body_cells = 0;
  for (int row = 0; row < logits.size; ++row) {
    for (int column = 0; column < logits.size; ++column) {
      const size_t cell = size_t(row) * size_t(logits.size) + size_t(column);
      const int part = memory.best[cell];
      if (!(memory.odds[cell] > min_odds)) continue;
      ++body_cells;
      if (!(is_torso(part) || is_head(part))) continue;
      const Point at = cells_to_image({column + 0.5, row + 0.5});
      if (is_head(part)) {
        head.add(at, 0);
      } else {
        const double u = double(logits.charts->at(part, row, column).u);
        torso.add(at, u >= 0 ? std::min(u, 1.0) : 0);  // 0 also for NaN
      }
    }
  }
  if (torso.count() < std::max(double(kMinTorsoCells), kMinTorsoFraction * body_cells)) return std::nullopt;
  const Point slope = unit(torso.slope());
  Point sum{-slope.x, -slope.y};
  if (head.count() >= kMinHeadCells) {
    const Point from = torso.mean(), to = head.mean();
    const Point up = unit({to.x - from.x, to.y - from.y});
    sum = {sum.x + up.x, sum.y + up.y};
  }
  if (!(std::hypot(sum.x, sum.y) > kMinAgreement)) return std::nullopt;
  return unit(sum);
}

bool leans(const std::optional<Point>& axis, double degrees, const Point& up) {
  return axis && axis->x * up.x + axis->y * up.y < std::cos(degrees * kPi / 180);
}

PersonCrop crop_around_person(int size, const AffineMap& cells_to_image, const std::optional<Point>& axis,
                              float mask_threshold, double margin, int side_px, const DecodeMemory& memory,
                              const OpenSides& without_margin) {
  PersonCrop crop;
  crop.is_rotated = leans(axis, kMinRotationDegrees);
  // The rotation about the image's origin that takes the axis to upright, (0, -1): x' = cos x - sin y.
  const double cos = crop.is_rotated ? -axis->y : 1, sin = crop.is_rotated ? -axis->x : 0;
  const AffineMap rotation{cos, -sin, 0, sin, cos, 0};
  Bounds bounds = bounds_of_person(size, cells_to_image.then(rotation), mask_threshold, memory);
  const double room = margin * std::max(bounds.high.x - bounds.low.x, bounds.high.y - bounds.low.y);
  if (!without_margin.left) bounds.low.x -= room;
  if (!without_margin.top) bounds.low.y -= room;
  if (!without_margin.right) bounds.high.x += room;
  if (!without_margin.bottom) bounds.high.y += room;
  const Point middle{(bounds.low.x + bounds.high.x) / 2, (bounds.low.y + bounds.high.y) / 2};
  const double width = bounds.high.x - bounds.low.x, height = bounds.high.y - bounds.low.y;
  const double scale = side_px / (kContext * std::max({width, height, 1.0}));
  crop.to_crop.xx = crop.to_crop.yy = scale * cos;
  crop.to_crop.xy = -scale * sin;
  crop.to_crop.yx = scale * sin;
  crop.to_crop.shift_x = 0.5 * side_px - scale * middle.x;
  crop.to_crop.shift_y = 0.5 * side_px - scale * middle.y;
  crop.to_image = crop.to_crop.inverse();
  const double half_width = scale * width / 2, half_height = scale * height / 2, half_side = 0.5 * side_px;
  crop.box = {float(half_side - half_width), float(half_side - half_height), float(half_side + half_width),
              float(half_side + half_height)};
  return crop;
}

Point steady_axis(const std::optional<Point>& axis, const PersonCrop& before) {
  return leans(axis, kSteadyDegrees, before.up()) ? *axis : before.up();
}

PersonCrop steady_crop(const PersonCrop& wanted, const PersonCrop& before, double max_shift_px) {
  const AffineMap between = wanted.to_image.then(before.to_crop);
  const Box &box = wanted.box, &old_box = before.box;
  double shift = 0;
  for (const auto& [x, old_x] : {std::pair(box.x0, old_box.x0), std::pair(box.x1, old_box.x1)}) {
    for (const auto& [y, old_y] : {std::pair(box.y0, old_box.y0), std::pair(box.y1, old_box.y1)}) {
      const Point corner = between({double(x), double(y)});
      shift = std::max({shift, std::abs(corner.x - double(old_x)), std::abs(corner.y - double(old_y))});
    }
  }
  return shift < max_shift_px ? before : wanted;
}

Box person_bounds(int size, const AffineMap& cells_to_image, float mask_threshold, const DecodeMemory& memory) {
  const Bounds bounds = bounds_of_person(size, cells_to_image, mask_threshold, memory);
  return {float(bounds.low.x), float(bounds.low.y), float(bounds.high.x), float(bounds.high.y)};
}

}  // namespace maq
