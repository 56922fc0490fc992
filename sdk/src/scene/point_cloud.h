// A point cloud in memory, 15 bytes a point.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace maq {

// 450 MB of positions and colours.
inline constexpr uint64_t kMaxPoints = 30'000'000;

// Reasons why points are dropped (capture/import_report.h).
inline constexpr char kPointsNotFinite[] = "points whose position is not finite";
inline constexpr char kColoursNotFinite[] = "points whose colour is not finite";

// PositionFormat of points, one array for each coordinate, relative to `origin`.
struct PointPositions {
  const float* x = nullptr;
  const float* y = nullptr;
  const float* z = nullptr;
  size_t count = 0;
  std::array<double, 3> origin = {0, 0, 0};
};

struct PointCloud {
  std::array<double, 3> origin = {0, 0, 0};
  std::vector<float> x, y, z;  // relative to the origin
  std::vector<uint8_t> rgb;    // three a point; empty when the cloud has no colours

  size_t count() const { return x.size(); }
  PointPositions positions() const { return {x.data(), y.data(), z.data(), x.size(), origin}; }

  void reserve(size_t points, bool has_colours) {
    x.reserve(points);
    y.reserve(points);
    z.reserve(points);
    if (has_colours) rgb.reserve(3 * points);
  }

  // False, and nothing is added, when a coordinate is not finite, or too far away for a float.
  bool add(double world_x, double world_y, double world_z) {
    const float position[3] = {float(world_x - origin[0]), float(world_y - origin[1]), float(world_z - origin[2])};
    if (!std::isfinite(position[0]) || !std::isfinite(position[1]) || !std::isfinite(position[2])) return false;
    x.push_back(position[0]);
    y.push_back(position[1]);
    z.push_back(position[2]);
    return true;
  }
};

// Keeps `max_points` of a larger cloud, at even steps through it; 0: all.
inline void thin_out(PointCloud& cloud, uint64_t max_points) {
  const uint64_t count = cloud.count();
  if (max_points == 0 || count <= max_points) return;
  for (uint64_t i = 0; i < max_points; ++i) {
    const size_t from = size_t(i * count / max_points);
    cloud.x[i] = cloud.x[from];
    cloud.y[i] = cloud.y[from];
    cloud.z[i] = cloud.z[from];
    if (!cloud.rgb.empty())
      std::copy_n(cloud.rgb.begin() + std::ptrdiff_t(3 * from), 3, cloud.rgb.begin() + std::ptrdiff_t(3 * i));
  }
  for (std::vector<float>* axis : {&cloud.x, &cloud.y, &cloud.z}) axis->resize(max_points);
  if (!cloud.rgb.empty()) cloud.rgb.resize(3 * max_points);
}

}  // namespace maq
