#include "scene/assembly/descriptor_sampling.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

// Regressions of points may lie anywhere in memory, so that each is prefetched.
constexpr size_t kAhead = 8;

// In the arithmetic of PointProjection: the first two rows are times the focal lengths.
void scaled_rotation(const PinholeCamera& camera, float rotation[9]) {
  for (size_t i = 0; i < 3; ++i) {
    rotation[i] = float(camera.rotation[i] * camera.fx_px);
    rotation[3 + i] = float(camera.rotation[3 + i] * camera.fy_px);
    rotation[6 + i] = float(camera.rotation[6 + i]);
  }
}

struct Away {
  double x, y, z;  // from the camera's centre
};

inline Away away_of(const PointPositions& positions, const PinholeCamera& camera, uint32_t point) {
  return {double(positions.x[point]) + (positions.origin[0] - camera.centre[0]),
          double(positions.y[point]) + (positions.origin[1] - camera.centre[1]),
          double(positions.z[point]) + (positions.origin[2] - camera.centre[2])};
}

struct Pixel {
  float column, row;
};

inline Pixel pixel_of(const float r[9], const PinholeCamera& camera, const Away& away) {
  const float x = float(away.x), y = float(away.y), z = float(away.z);
  const float forward = r[6] * x + r[7] * y + r[8] * z;
  const float safe = forward > 0 ? forward : 1.0f;
  return {(r[0] * x + r[1] * y + r[2] * z) / safe + float(camera.cx_px),
          (r[3] * x + r[4] * y + r[5] * z) / safe + float(camera.cy_px)};
}

inline float within(float value, int size) { return std::min(std::max(value, 0.0f), float(size - 1)); }

}  // namespace

void keep_valid(const PointPositions& positions, const PinholeCamera& camera, const uint8_t* valid,
                std::vector<uint32_t>& points) {
  float rotation[9];
  scaled_rotation(camera, rotation);
  const auto is_blank = [&](uint32_t point) {
    const Pixel at = pixel_of(rotation, camera, away_of(positions, camera, point));
    const auto column = size_t(within(at.column, camera.width_px) + 0.5f);
    const auto row = size_t(within(at.row, camera.height_px) + 0.5f);
    return valid[row * size_t(camera.width_px) + column] == 0;
  };
  points.erase(std::remove_if(points.begin(), points.end(), is_blank), points.end());
}

DescriptorSampling::DescriptorSampling(const PointPositions& positions, const PinholeCamera& camera,
                                       const float* features, const ViewBasis& basis)
    : places_(positions), camera_(camera), features_(features), basis_(basis) {
  scaled_rotation(camera, rotation_);
}

void DescriptorSampling::add(const uint32_t* points, size_t count, RegressionStore& regressions) const {
  Pixel pixels[kMaxPoints];
  float directions[3][kMaxPoints] = {}, basis_values[kBasis * kMaxPoints];
  for (size_t i = 0; i < count; ++i) {
    const Away away = away_of(places_, camera_, points[i]);
    pixels[i] = pixel_of(rotation_, camera_, away);
    // A point in the camera's centre has no direction.
    constexpr double kShortest = 1e-7;
    const double scale = 1 / (std::sqrt(away.x * away.x + away.y * away.y + away.z * away.z) + kShortest);
    directions[0][i] = float(away.x * scale);
    directions[1][i] = float(away.y * scale);
    directions[2][i] = float(away.z * scale);
  }
  basis_.evaluate(directions[0], directions[1], directions[2], count, basis_values);

  const int width = camera_.width_px, height = camera_.height_px;
  for (size_t i = 0; i < count; ++i) {
    if (i + kAhead < count) {
      const char* later = reinterpret_cast<const char*>(&regressions.of(points[i + kAhead]));
      constexpr size_t kCacheLine = 64;
      for (size_t offset = 0; offset < sizeof(DescriptorRegression); offset += kCacheLine)
        __builtin_prefetch(later + offset, 1);
    }
    const float x = within(pixels[i].column, width), y = within(pixels[i].row, height);
    const int left = int(x), above = int(y);
    const int right = std::min(left + 1, width - 1), below = std::min(above + 1, height - 1);
    const float to_right = x - float(left), down = y - float(above);
    const auto at = [&](int column, int row) {
      return features_ + (size_t(row) * size_t(width) + size_t(column)) * kFeatures;
    };
    const float *a = at(left, above), *b = at(right, above), *c = at(left, below), *d = at(right, below);
    float feature[kFeatures], h[kBasis];
    for (int k = 0; k < kFeatures; ++k) {
      const float upper = a[k] + to_right * (b[k] - a[k]), lower = c[k] + to_right * (d[k] - c[k]);
      feature[k] = upper + down * (lower - upper);
    }
    for (int k = 0; k < kBasis; ++k) h[k] = basis_values[size_t(k) * count + i];
    regressions.of(points[i]).add(feature, h);
  }
}

}  // namespace maq
