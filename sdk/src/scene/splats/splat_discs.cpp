#include "scene/splats/splat_discs.h"

#include <algorithm>
#include <cmath>

#include "core/math/rotation.h"
#include "core/math/small_solve.h"
#include "scene/format/block_codec.h"

namespace maq {
namespace {

// Neighbours that span the plane, and the one whose distance is the size of a gap.
constexpr size_t kPlaneNeighbours = 8, kGapNeighbour = 6;
// The standard deviation of a disc in gaps (measured on tests/media/room), its least and greatest thickness in that.
constexpr double kGapDeviation = 0.45, kMinThickness = 0.1;
// The largest gap, in the usual one among its neighbours: stray points would become blots.
constexpr double kMaxGap = 2;
constexpr float kDiscOpacity = 0.99f;

struct Neighbours {
  size_t count = 0;
  float distance[kPlaneNeighbours];  // squared, rising
  uint32_t index[kPlaneNeighbours];

  void add(float squared, uint32_t neighbour) {
    size_t at = std::min(count, kPlaneNeighbours - 1);
    if (count == kPlaneNeighbours && squared >= distance[at]) return;
    for (; at > 0 && distance[at - 1] > squared; --at) {
      distance[at] = distance[at - 1];
      index[at] = index[at - 1];
    }
    distance[at] = squared;
    index[at] = neighbour;
    count = std::min(count + 1, kPlaneNeighbours);
  }
};

// The nearest points of the same block: these are neighbours, but for a few at its border.
Neighbours neighbours_of(const FittedPoints& points, size_t of) {
  Neighbours found;
  const float x = points.x[of], y = points.y[of], z = points.z[of];
  for (size_t i = 0; i < points.count(); ++i) {
    const float dx = points.x[i] - x, dy = points.y[i] - y, dz = points.z[i] - z;
    const float squared = dx * dx + dy * dy + dz * dz;
    if (squared > 0) found.add(squared, uint32_t(i));
  }
  return found;
}

std::array<float, 4> quaternion_of(const std::array<Vec3, 3>& axes) {
  const Mat3 turn = {axes[0].x, axes[1].x, axes[2].x, axes[0].y, axes[1].y, axes[2].y, axes[0].z, axes[1].z, axes[2].z};
  const Vec3 w = log_rotation(turn);
  const double angle = length(w);
  const Vec3 part = (sine_ratio(angle / 2) / 2) * w;
  return {float(std::cos(angle / 2)), float(part.x), float(part.y), float(part.z)};
}

// The distance to the neighbours; 0 for a point without any.
double gap_of(const Neighbours& near) {
  return near.count > 0 ? std::sqrt(double(near.distance[std::min(near.count, kGapNeighbour) - 1])) : 0;
}

Splat disc_of(const FittedPoints& points, const std::array<double, 3>& origin, size_t i, const Neighbours& near,
              double gap) {
  Splat disc;
  disc.position = {origin[0] + double(points.x[i]), origin[1] + double(points.y[i]), origin[2] + double(points.z[i])};
  for (size_t c = 0; c < 3; ++c) disc.colour[c] = points.constant_terms[i * kFeatures + c];
  disc.opacity = kDiscOpacity;
  const double deviation = kGapDeviation * gap;
  disc.scale = {float(deviation), float(deviation), float(deviation)};
  if (near.count < 3) return disc;
  std::array<double, 6> spread{};
  for (size_t k = 0; k < near.count; ++k) {
    const size_t n = near.index[k];
    const double d[3] = {double(points.x[n] - points.x[i]), double(points.y[n] - points.y[i]),
                         double(points.z[n] - points.z[i])};
    const double terms[6] = {d[0] * d[0], d[0] * d[1], d[0] * d[2], d[1] * d[1], d[1] * d[2], d[2] * d[2]};
    for (size_t t = 0; t < 6; ++t) spread[t] += terms[t] / double(near.count);
  }
  PrincipalAxes plane = principal_axes(spread);
  plane.axis[2] = cross(plane.axis[0], plane.axis[1]);
  disc.rotation = quaternion_of(plane.axis);
  const double thickness = kGapDeviation * std::sqrt(std::max(plane.variance[2], 0.0));
  disc.scale[2] = float(std::clamp(thickness, kMinThickness * deviation, deviation));
  return disc;
}

}  // namespace

Splats splats_of_points(const Scene& scene, WorkerThreads& threads) {
  std::vector<std::vector<Splat>> discs(scene.block_count);
  threads.run(scene.block_count, [&](size_t b, int) {
    const SceneBlock& block = scene.blocks[b];
    const FittedPoints points = decode_block(scene, block);
    std::vector<Neighbours> near;
    std::vector<double> gaps;
    for (size_t i = 0; i < points.count(); ++i) {
      near.push_back(neighbours_of(points, i));
      gaps.push_back(gap_of(near.back()));
    }
    std::vector<double> sorted = gaps;
    const auto middle = sorted.begin() + std::ptrdiff_t(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    // Points that are alone, or all in one place, have no gap.
    double usual = *middle;
    for (size_t axis = 0; axis < 3 && *middle == 0; ++axis) {
      usual = std::max(usual, double(block.high[axis] - block.low[axis]) / double(points.count()));
    }
    for (size_t i = 0; i < points.count(); ++i) {
      const double gap = gaps[i] > 0 ? std::min(gaps[i], kMaxGap * usual) : usual;
      discs[b].push_back(disc_of(points, scene.origin, i, near[i], gap));
    }
  });
  Splats splats;
  splats.up = scene.up;
  splats.reserve(scene.points);
  for (const std::vector<Splat>& of_block : discs) {
    for (const Splat& disc : of_block) splats.add(disc);
  }
  return splats;
}

}  // namespace maq
