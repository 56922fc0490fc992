// The texels that a mesh covers by its texture coordinates, values between the pixels of images, and between limits.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "head/mesh/head_mesh.h"

namespace maq::head {

inline constexpr int kTexelRowsOfTask = 16;

// Calls `use(texel, corners, shares)` for each texel of the rows in each triangle that covers its middle: three
// vertices and their barycentric shares. `coordinates`: [vertices][2], u to the right, v down, 0 to 1.
template <class Use>
void for_each_texel(const std::vector<float>& coordinates, const std::vector<uint32_t>& triangles, int side,
                    int first_row, int end_row, Use&& use) {
  const auto corner = [&](uint32_t vertex, size_t axis) {
    return double(coordinates[2 * size_t(vertex) + axis]) * side - 0.5;
  };
  for (size_t i = 0; i < triangles.size(); i += 3) {
    const uint32_t* const t = &triangles[i];
    const double x[3] = {corner(t[0], 0), corner(t[1], 0), corner(t[2], 0)};
    const double y[3] = {corner(t[0], 1), corner(t[1], 1), corner(t[2], 1)};
    const int top = std::max(first_row, int(std::ceil(std::min({y[0], y[1], y[2]}))));
    const int bottom = std::min(end_row - 1, int(std::floor(std::max({y[0], y[1], y[2]}))));
    if (top > bottom) continue;
    const int left = std::max(0, int(std::ceil(std::min({x[0], x[1], x[2]}))));
    const int right = std::min(side - 1, int(std::floor(std::max({x[0], x[1], x[2]}))));
    const double area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    if (area == 0) continue;
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        double shares[3];
        shares[0] = ((x[1] - column) * (y[2] - row) - (x[2] - column) * (y[1] - row)) / area;
        shares[1] = ((x[2] - column) * (y[0] - row) - (x[0] - column) * (y[2] - row)) / area;
        shares[2] = 1 - shares[0] - shares[1];
        if (shares[0] < 0 || shares[1] < 0 || shares[2] < 0) continue;
        use(size_t(row) * size_t(side) + size_t(column), t, shares);
      }
    }
  }
}

// 0 up to `first`, 1 from `whole` on, and a cubic between them.
inline double smooth_step(double value, double first, double whole) {
  const double t = std::clamp((value - first) / (whole - first), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// Bilinear, of values [height][width][channels] at a position within them; pixel centres are whole numbers.
template <class T, size_t kChannels>
std::array<double, kChannels> between_pixels(const std::vector<T>& values, int width, int height, double x, double y) {
  x = std::clamp(x, 0.0, width - 1.0), y = std::clamp(y, 0.0, height - 1.0);
  const int left = std::min(int(x), std::max(0, width - 2)), top = std::min(int(y), std::max(0, height - 2));
  const double along = x - left, down = y - top;
  std::array<double, kChannels> made{};
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const int column = std::min(left + i, width - 1), row = std::min(top + j, height - 1);
      const double share = (i == 0 ? 1 - along : along) * (j == 0 ? 1 - down : down);
      const size_t at = (size_t(row) * size_t(width) + size_t(column)) * kChannels;
      for (size_t c = 0; c < kChannels; ++c) made[c] += share * double(values[at + c]);
    }
  }
  return made;
}

}  // namespace maq::head
