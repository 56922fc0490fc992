#include "head/fit/anchor_points.h"

#include <algorithm>
#include <cmath>

namespace maq::head {
namespace {

constexpr double kSoftening_dm = 1e-3;  // within which of an anchor the others no longer count

Vec3 point_at(const std::vector<float>& points, size_t index) {
  return {double(points[3 * index]), double(points[3 * index + 1]), double(points[3 * index + 2])};
}

}  // namespace

AnchorPoints::Place AnchorPoints::place(Vec3 template_point) const {
  constexpr size_t kCount = kNeighbours;
  Place found;
  float nearest[kCount];
  std::fill(nearest, nearest + kCount, INFINITY);
  const float x = float(template_point.x), y = float(template_point.y), z = float(template_point.z);
  const float* t = anchors_.template_points.data();
  for (size_t i = 0; i < anchors_.count(); ++i, t += 3) {
    const float square = (t[0] - x) * (t[0] - x) + (t[1] - y) * (t[1] - y) + (t[2] - z) * (t[2] - z);
    if (!(square < nearest[kCount - 1])) continue;
    size_t at = kCount - 1;
    for (; at > 0 && square < nearest[at - 1]; --at) {
      nearest[at] = nearest[at - 1];
      found.anchors[at] = found.anchors[at - 1];
    }
    nearest[at] = square;
    found.anchors[at] = i;
  }
  double sum = 0;
  for (size_t k = 0; k < kCount; ++k) {
    found.weights[k] = 1 / (double(nearest[k]) + kSoftening_dm * kSoftening_dm);
    sum += found.weights[k];
  }
  found.distance_dm = std::sqrt(double(nearest[0]));
  found.mean = template_point;
  for (size_t k = 0; k < kCount; ++k) {
    found.weights[k] /= sum;
    const size_t anchor = found.anchors[k];
    found.mean =
        found.mean + found.weights[k] * (point_at(anchors_.mean, anchor) - point_at(anchors_.template_points, anchor));
    found.sigma_dm += found.weights[k] * double(anchors_.sigma[anchor]);
  }
  return found;
}

void AnchorPoints::linear(const Place& place, double* rows) const {
  std::fill(rows, rows + 3 * codes_, 0.0);
  for (size_t k = 0; k < kNeighbours; ++k) {
    const float* from = anchors_.linear.data() + place.anchors[k] * 3 * codes_;
    for (size_t i = 0; i < 3 * codes_; ++i) rows[i] += place.weights[k] * double(from[i]);
  }
}

Vec3 AnchorPoints::point(const Place& place, const float* shape) const {
  double sums[3] = {};
  for (size_t k = 0; k < kNeighbours; ++k) {
    const float* from = anchors_.linear.data() + place.anchors[k] * 3 * codes_;
    for (size_t axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (size_t i = 0; i < codes_; ++i) sum += double(from[axis * codes_ + i]) * double(shape[i]);
      sums[axis] += place.weights[k] * sum;
    }
  }
  return place.mean + Vec3{sums[0], sums[1], sums[2]};
}

}  // namespace maq::head
