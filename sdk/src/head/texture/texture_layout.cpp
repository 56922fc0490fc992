#include "head/texture/texture_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maq::head {
namespace {

constexpr double kDiscRadius = 0.485;
constexpr double kLargestAngle = 165 * 3.14159265358979323846 / 180;  // of the border; the rim of cuts is before it
// The cap's disc, as large as the corner has room for, and how far the cap reaches.
constexpr double kCapMiddle = 0.915, kCapRadius = 0.08, kCapReach_dm = 1.6;
constexpr uint32_t kNoVertex = std::numeric_limits<uint32_t>::max();

std::array<float, 2> cap_place(const float* position) {
  double x = double(position[0]) / kCapReach_dm, y = double(position[1]) / kCapReach_dm;
  const double beyond = std::max(1.0, std::hypot(x, y));
  x /= beyond, y /= beyond;
  return {float(kCapMiddle + kCapRadius * x), float(kCapMiddle + kCapRadius * y)};  // as seen from below
}

template <class T>
void repeat(std::vector<T>& values, size_t each, size_t vertex) {
  if (values.empty()) return;
  for (size_t k = 0; k < each; ++k) values.push_back(T(values[vertex * each + k]));
}

}  // namespace

std::array<float, 2> texture_place(Vec3 template_point) {
  const Vec3 direction = template_point - kLayoutCentre;
  const double across = std::hypot(direction.x, direction.y);
  const double angle = std::atan2(across, direction.z);
  const double radius = kDiscRadius * std::min(1.0, std::sin(angle / 2) / std::sin(kLargestAngle / 2));
  if (!(across > 0)) return {0.5f, 0.5f};
  return {float(0.5 + radius * direction.x / across), float(0.5 - radius * direction.y / across)};
}

double texture_angle(double radius) {
  return 2 * std::asin(std::clamp(radius / kDiscRadius * std::sin(kLargestAngle / 2), 0.0, 1.0));
}

bool is_in_cap_disc(float u, float v) {
  return std::hypot(double(u) - kCapMiddle, double(v) - kCapMiddle) < kCapRadius + 0.01;
}

void set_texture_coordinates(HeadMesh& mesh, const std::vector<uint8_t>& is_cap) {
  const size_t count = mesh.vertex_count();
  mesh.texture_coordinates.resize(2 * count);
  std::vector<uint8_t> is_outside(count);  // a corner of a triangle that is not of the cap
  const auto is_of_cap = [&](size_t triangle) {
    const uint32_t* const t = &mesh.triangles[3 * triangle];
    return is_cap[t[0]] != 0 && is_cap[t[1]] != 0 && is_cap[t[2]] != 0;
  };
  for (size_t i = 0; i < mesh.triangle_count(); ++i) {
    if (is_of_cap(i)) continue;
    for (size_t k = 0; k < 3; ++k) is_outside[mesh.triangles[3 * i + k]] = 1;
  }
  for (size_t i = 0; i < count; ++i) {
    const float* const t = &mesh.template_points[3 * i];
    const auto place = is_outside[i] != 0 ? texture_place({double(t[0]), double(t[1]), double(t[2])})
                                          : cap_place(&mesh.positions[3 * i]);
    mesh.texture_coordinates[2 * i] = place[0], mesh.texture_coordinates[2 * i + 1] = place[1];
  }
  std::vector<uint32_t> copies(count, kNoVertex);
  for (size_t i = 0; i < mesh.triangle_count(); ++i) {
    if (!is_of_cap(i)) continue;
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t vertex = mesh.triangles[3 * i + k];
      if (is_outside[vertex] != 0 && copies[vertex] == kNoVertex) copies[vertex] = 0;
    }
  }
  for (size_t i = 0; i < count; ++i) {
    if (copies[i] == kNoVertex) continue;
    copies[i] = uint32_t(mesh.vertex_count());
    const auto place = cap_place(&mesh.positions[3 * i]);
    mesh.texture_coordinates.insert(mesh.texture_coordinates.end(), place.begin(), place.end());
    repeat(mesh.positions, 3, i), repeat(mesh.normals, 3, i);
    repeat(mesh.colours, 3, i), repeat(mesh.template_points, 3, i);
  }
  std::vector<uint8_t> was_cap(mesh.triangle_count());
  for (size_t i = 0; i < was_cap.size(); ++i) was_cap[i] = is_of_cap(i) ? 1 : 0;
  for (size_t corner = 0; corner < mesh.triangles.size(); ++corner) {
    if (was_cap[corner / 3] != 0 && copies[mesh.triangles[corner]] != kNoVertex) {
      mesh.triangles[corner] = copies[mesh.triangles[corner]];
    }
  }
}

}  // namespace maq::head
