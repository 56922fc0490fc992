// The frame of mesh files and of apps: metres, x to the person's left, y up, z to the front; and the format of
// textures.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/math/rotation.h"
#include "head/mesh/head_mesh.h"

namespace maq::head {

// (x, y, z) of the head frame is (x, z, -y) in files and for apps.
inline Vec3 to_file_axes(Vec3 p) { return {p.x, p.z, -p.y}; }
inline Vec3 from_file_axes(Vec3 p) { return {p.x, -p.z, p.y}; }

// The rotation of a camera from the head frame, as a rotation from file axes.
inline Mat3 rotation_from_file_axes(const Mat3& r) { return {r[0], r[2], -r[1], r[3], r[5], -r[4], r[6], r[8], -r[7]}; }

template <class ScaleOf>
std::vector<float> to_file_axes(const std::vector<float>& from, ScaleOf&& scale_of) {
  std::vector<float> made(from.size());
  for (size_t i = 0; i + 2 < from.size(); i += 3) {
    const double scale = scale_of(&from[i]);
    made[i] = float(scale * double(from[i]));
    made[i + 1] = float(scale * double(from[i + 2]));
    made[i + 2] = float(-scale * double(from[i + 1])) + 0.0f;  // no -0
  }
  return made;
}

inline std::vector<float> positions_in_file(const HeadMesh& mesh) {
  return to_file_axes(mesh.positions, [](const float*) { return 0.1; });
}

// Normals of length 1, or 0 where they were 0.
inline std::vector<float> normals_in_file(const HeadMesh& mesh) {
  return to_file_axes(mesh.normals, [](const float* n) {
    const double x = double(n[0]), y = double(n[1]), z = double(n[2]), length = std::sqrt(x * x + y * y + z * z);
    return length > 0 ? 1 / length : 1;
  });
}

inline bool is_jpeg(const std::vector<uint8_t>& file) {
  return file.size() > 3 && file[0] == 0xFF && file[1] == 0xD8 && file[2] == 0xFF;
}

inline bool is_png(const std::vector<uint8_t>& file) {
  return file.size() > 8 && file[0] == 0x89 && file[1] == 'P' && file[2] == 'N' && file[3] == 'G' && file[4] == '\r' &&
         file[5] == '\n' && file[6] == 0x1A && file[7] == '\n';
}

}  // namespace maq::head
