// A point cloud in memory, 15 bytes a point.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace maq {

// 450 MB of places and colours.
inline constexpr uint64_t kMostPoints = 30'000'000;

// Reasons why points are dropped (drop_counts.h).
inline constexpr char kPointsNotFinite[] = "points whose place is not finite";
inline constexpr char kColoursNotFinite[] = "points whose colour is not finite";

// Places of points, one array for each coordinate, relative to `origin`.
struct PointPlaces {
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
  PointPlaces places() const { return {x.data(), y.data(), z.data(), x.size(), origin}; }

  void reserve(size_t points, bool has_colours) {
    x.reserve(points);
    y.reserve(points);
    z.reserve(points);
    if (has_colours) rgb.reserve(3 * points);
  }

  // False, and nothing is added, when a coordinate is not finite, or too far away for a float.
  bool add(double world_x, double world_y, double world_z) {
    const float place[3] = {float(world_x - origin[0]), float(world_y - origin[1]), float(world_z - origin[2])};
    if (!std::isfinite(place[0]) || !std::isfinite(place[1]) || !std::isfinite(place[2])) return false;
    x.push_back(place[0]);
    y.push_back(place[1]);
    z.push_back(place[2]);
    return true;
  }
};

// Takes points evenly from a cloud of more than `most`; 0: all stay.
inline void thin_out(PointCloud& cloud, uint64_t most) {
  const uint64_t count = cloud.count();
  if (most == 0 || count <= most) return;
  for (uint64_t i = 0; i < most; ++i) {
    const size_t from = size_t(i * count / most);
    cloud.x[i] = cloud.x[from];
    cloud.y[i] = cloud.y[from];
    cloud.z[i] = cloud.z[from];
    if (!cloud.rgb.empty())
      std::copy_n(cloud.rgb.begin() + std::ptrdiff_t(3 * from), 3, cloud.rgb.begin() + std::ptrdiff_t(3 * i));
  }
  for (std::vector<float>* axis : {&cloud.x, &cloud.y, &cloud.z}) axis->resize(most);
  if (!cloud.rgb.empty()) cloud.rgb.resize(3 * most);
}

}  // namespace maq
