#include "edges/curves/corners.h"

#include <algorithm>

#include "core/math/small_solve.h"

namespace maq {
namespace {

constexpr double kMiss_r = 2.5;    // curves that pass each other at more do not meet
constexpr double kOverlap_px = 4;  // how far a curve may have run beyond the corner
constexpr double kFixed = 0.01;    // weight of the ends' middle against the lines through them
constexpr double kParallelSine = 0.2;

bool meet(const CurveEnd& a, const CurveEnd& b, double merge_radius_px) {
  const double r = std::max(a.r_m, b.r_m);
  const Vec3 between = b.point - a.point;
  const double distance = length(between);
  if (!(distance <= 2 * merge_radius_px * std::max(a.step_m, b.step_m))) return false;
  const double cosine = dot(a.outward, b.outward), sine_squared = 1 - cosine * cosine;
  if (sine_squared < kParallelSine * kParallelSine) return distance <= kMiss_r * r;
  // The nearest points of the two lines.
  const double pa = dot(between, a.outward), pb = -dot(between, b.outward);
  const double s = (pa + cosine * pb) / sine_squared, t = (pb + cosine * pa) / sine_squared;
  const Vec3 miss = between + t * b.outward - s * a.outward;
  return length(miss) <= kMiss_r * r && s >= -kOverlap_px * a.step_m && s <= merge_radius_px * a.step_m &&
         t >= -kOverlap_px * b.step_m && t <= merge_radius_px * b.step_m;
}

Vec3 nearest_to_all(const std::vector<CurveEnd>& ends, const std::vector<int>& group, int root) {
  Vec3 origin, mean;
  double count = 0;
  double a[9] = {}, b[3] = {};
  for (size_t i = 0; i < ends.size(); ++i) {
    if (group[i] != root) continue;
    if (count == 0) origin = ends[i].point;
    const Vec3 d = ends[i].outward, p = ends[i].point - origin;
    const Vec3 across = p - dot(p, d) * d;
    const double v[3] = {d.x, d.y, d.z}, right[3] = {across.x, across.y, across.z};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c <= r; ++c) a[3 * r + c] += (r == c) - v[r] * v[c];
      b[r] += right[r];
    }
    mean = mean + p;
    count += 1;
  }
  for (int r = 0; r < 3; ++r) a[4 * r] += kFixed * count;
  b[0] += kFixed * mean.x, b[1] += kFixed * mean.y, b[2] += kFixed * mean.z;
  if (!solve_positive(a, 3, 3, b, 1)) return origin + (1 / count) * mean;
  return origin + Vec3{b[0], b[1], b[2]};
}

}  // namespace

void CornerFinder::find(std::vector<CurveEnd>& ends, double merge_radius_px, std::vector<EdgeCorner>& corners) {
  corners.clear();
  const auto n = int(ends.size());
  group_.resize(ends.size());
  for (int i = 0; i < n; ++i) group_[size_t(i)] = i;
  const auto root_of = [&](int i) {
    while (group_[size_t(i)] != i) i = group_[size_t(i)] = group_[size_t(group_[size_t(i)])];
    return i;
  };
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j) {
      if (!meet(ends[size_t(i)], ends[size_t(j)], merge_radius_px)) continue;
      const int a = root_of(i), b = root_of(j);
      group_[size_t(std::max(a, b))] = std::min(a, b);
    }
  }
  for (int i = 0; i < n; ++i) group_[size_t(i)] = root_of(i);
  for (int root = 0; root < n; ++root) {
    if (group_[size_t(root)] != root || std::count(group_.begin(), group_.end(), root) < 2) continue;
    // Ends that do not pass the point are left out, and the others have it to themselves.
    Vec3 point;
    for (int round = 0; round < 2; ++round) {
      point = nearest_to_all(ends, group_, root);
      for (int i = root; i < n; ++i) {
        if (group_[size_t(i)] != root) continue;
        const CurveEnd& end = ends[size_t(i)];
        const Vec3 off = point - end.point;
        const bool passes = length(cross(off, end.outward)) <= kMiss_r * end.r_m &&
                            std::abs(dot(off, end.outward)) <= 1.5 * merge_radius_px * end.step_m;
        if (!passes) group_[size_t(i)] = -1;
      }
      if (std::count(group_.begin(), group_.end(), root) == 0) break;
    }
    EdgeCorner corner{point, int(std::count(group_.begin(), group_.end(), root))};
    if (corner.curve_count < 2) continue;
    for (int i = root; i < n; ++i) {
      if (group_[size_t(i)] == root) ends[size_t(i)].corner = int(corners.size());
    }
    corners.push_back(corner);
  }
}

}  // namespace maq
