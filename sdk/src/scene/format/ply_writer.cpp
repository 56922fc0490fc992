#include "scene/format/ply_writer.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/files/atomic_file.h"
#include "scene/format/block_codec.h"

namespace maq {
namespace {

constexpr double kFarOrigin = 100;

bool needs_doubles(const Scene& scene) {
  const SceneBounds bounds = bounds_of(scene);
  double size = 0, away = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    size = std::max(size, bounds.high[axis] - bounds.low[axis]);
    away = std::max(away, std::abs(scene.origin[axis]));
  }
  return away > kFarOrigin * size;
}

uint8_t colour(float value) { return uint8_t(std::lround(255 * std::clamp(value, 0.0f, 1.0f))); }

template <class Number>
void put(std::vector<uint8_t>& bytes, Number number) {
  const size_t at = bytes.size();
  bytes.resize(at + sizeof number);
  std::memcpy(bytes.data() + at, &number, sizeof number);
}

}  // namespace

void write_scene_ply(const Scene& scene, const std::string& path) {
  const bool is_double = needs_doubles(scene);
  const std::string type = is_double ? "double" : "float";
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment points of a Maquette scene\nelement vertex " +
      std::to_string(scene.points) + "\nproperty " + type + " x\nproperty " + type + " y\nproperty " + type +
      " z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
  AtomicFile file(path);
  file.append(header.data(), header.size());
  std::vector<uint8_t> bytes;
  for (uint32_t b = 0; b < scene.block_count; ++b) {
    const FittedPoints points = decode_block(scene, scene.blocks[b]);
    bytes.clear();
    for (size_t i = 0; i < points.count(); ++i) {
      const float at[3] = {points.x[i], points.y[i], points.z[i]};
      for (size_t axis = 0; axis < 3; ++axis) {
        const double world = scene.origin[axis] + double(at[axis]);
        if (is_double) {
          put(bytes, world);
        } else {
          put(bytes, float(world));
        }
      }
      for (size_t c = 0; c < 3; ++c) put(bytes, colour(points.constant_terms[i * kFeatures + c]));
    }
    file.append(bytes.data(), bytes.size());
  }
  file.commit();
}

}  // namespace maq
