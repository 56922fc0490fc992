#include "head/fit/distance_grid.h"

#include <algorithm>
#include <cmath>

namespace maq::head {
namespace {

constexpr double kMaxSlope = 1.5;  // of the distance, which steps along a ray count on

}  // namespace

DistanceGrid::DistanceGrid(const HeadBounds& bounds, const CutPlane& cut, int side)
    : bounds_(bounds), cut_(cut), side_(std::clamp(side, 2, 128)) {
  const auto& low = bounds.min;
  const auto& high = bounds.max;
  origin_ = {double(low[0]), double(low[1]), double(low[2])};
  const double cells = side_ - 1;
  cells_per_dm_ = {cells / double(high[0] - low[0]), cells / double(high[1] - low[1]),
                   cells / double(high[2] - low[2])};
  values_.resize(size_t(side_) * size_t(side_) * size_t(side_), 1.0f);
}

double DistanceGrid::cell_dm() const { return 1 / std::min({cells_per_dm_.x, cells_per_dm_.y, cells_per_dm_.z}); }

void DistanceGrid::update(const FieldEngine& engine, WorkerThreads& threads) {
  workspaces_.resize(size_t(std::max(threads.count(), int(workspaces_.size()))));
  const size_t side = size_t(side_), layer = side * side;
  threads.run(side, [&](size_t k, int worker) {
    std::vector<float> columns(3 * layer);
    float *x = columns.data(), *y = x + layer, *z = y + layer;
    for (size_t i = 0; i < layer; ++i) {
      const size_t row = i / side, column = i % side;
      x[i] = float(origin_.x + double(column) / cells_per_dm_.x);
      y[i] = float(origin_.y + double(row) / cells_per_dm_.y);
      z[i] = float(origin_.z + double(k) / cells_per_dm_.z);
    }
    float* to = values_.data() + k * layer;
    engine.distances({x, y, z, layer}, workspaces_[size_t(worker)], to);
    for (size_t i = 0; i < layer; ++i) {
      to[i] = std::max(to[i], float(cut_.distance({double(x[i]), double(y[i]), double(z[i])})));
    }
  });
}

double DistanceGrid::at(Vec3 p) const {
  const double at[3] = {(p.x - origin_.x) * cells_per_dm_.x, (p.y - origin_.y) * cells_per_dm_.y,
                        (p.z - origin_.z) * cells_per_dm_.z};
  size_t index[3];
  double part[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double within = std::clamp(at[axis], 0.0, double(side_ - 1));
    index[axis] = std::min(size_t(within), size_t(side_ - 2));
    part[axis] = within - double(index[axis]);
  }
  const size_t side = size_t(side_);
  const float* corner = values_.data() + (index[2] * side + index[1]) * side + index[0];
  const auto along_x = [&](const float* from) {
    return double(from[0]) + part[0] * (double(from[1]) - double(from[0]));
  };
  const auto in_plane = [&](const float* from) {
    const double low = along_x(from);
    return low + part[1] * (along_x(from + side) - low);
  };
  const double low = in_plane(corner);
  return low + part[2] * (in_plane(corner + side * side) - low);
}

DistanceGrid::Nearest DistanceGrid::find(Vec3 base, Vec3 direction, double first, double enough_dm) const {
  Nearest result;
  double begin = first, end = 1e9;
  const double from[3] = {base.x, base.y, base.z}, along[3] = {direction.x, direction.y, direction.z};
  for (size_t axis = 0; axis < 3; ++axis) {
    const double low = double(bounds_.min[axis]), high = double(bounds_.max[axis]);
    if (std::abs(along[axis]) < 1e-12) {
      if (!(from[axis] >= low && from[axis] <= high)) return result;
      continue;
    }
    const double a = (low - from[axis]) / along[axis], b = (high - from[axis]) / along[axis];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  const double speed = length(direction);
  if (!(begin < end) || !std::isfinite(speed) || !(speed > 0)) return result;
  result.is_in_domain = true;
  const double least = 0.5 * cell_dm() / speed;
  double before = 0, before_depth = begin, outside = begin;
  result.distance_dm = 1e9;
  for (double depth = begin;;) {
    const double f = at(base + depth * direction);
    if (f <= 0) {
      result.is_hit = true;
      result.distance_dm = 0;
      result.depth = depth > begin ? before_depth + (depth - before_depth) * before / (before - f) : depth;
      result.begin = outside;
      double low = f;
      result.end = depth;
      while (depth < end && low > -enough_dm) {
        depth = std::min(end, depth + least);
        const double next = at(base + depth * direction);
        if (!(next < low)) break;
        low = next, result.end = depth;
      }
      return result;
    }
    if (f >= enough_dm) outside = depth;
    if (f < result.distance_dm) {
      result.distance_dm = f;
      result.depth = result.end = depth;
      result.begin = outside;
    }
    if (!(depth < end)) return result;
    before = f, before_depth = depth;
    depth = std::min(end, depth + std::max(least, f / (kMaxSlope * speed)));
  }
}

}  // namespace maq::head
