#include "head/mesh/mesh_cleanup.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "head/mesh/marching_cubes.h"

namespace maq::head {
namespace {

using Vector = std::array<double, 3>;

// Along the normal, of twice the triangle's area.
Vector area_vector(const HeadMesh& mesh, size_t triangle) {
  const uint32_t* const corners = &mesh.triangles[3 * triangle];
  const float* const p = &mesh.positions[3 * size_t(corners[0])];
  const float* const q = &mesh.positions[3 * size_t(corners[1])];
  const float* const r = &mesh.positions[3 * size_t(corners[2])];
  Vector made{};
  for (size_t axis = 0; axis < 3; ++axis) {
    const size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
    made[axis] = (double(q[a]) - double(p[a])) * (double(r[b]) - double(p[b])) -
                 (double(q[b]) - double(p[b])) * (double(r[a]) - double(p[a]));
  }
  return made;
}

double length_of(const Vector& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

uint32_t root_of(std::vector<uint32_t>& parents, uint32_t of) {
  while (parents[of] != of) of = parents[of] = parents[parents[of]];
  return of;
}

// Moves the kept vertices together; `numbers` has the new index of each vertex, or the largest number for a removed
// vertex.
template <class T>
void compact(std::vector<T>& values, const std::vector<uint32_t>& numbers, size_t kept) {
  if (values.empty()) return;
  const size_t each = values.size() / numbers.size();
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] == std::numeric_limits<uint32_t>::max()) continue;
    std::copy_n(&values[i * each], each, &values[numbers[i] * each]);
  }
  values.resize(kept * each);
}

}  // namespace

void keep_largest_piece(HeadMesh& mesh) {
  if (mesh.triangles.empty()) return;
  std::vector<uint32_t> parents(mesh.vertex_count());
  for (size_t i = 0; i < parents.size(); ++i) parents[i] = uint32_t(i);
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const uint32_t a = root_of(parents, mesh.triangles[i]), b = root_of(parents, mesh.triangles[i / 3 * 3]);
    parents[std::max(a, b)] = std::min(a, b);
  }
  std::vector<double> areas(mesh.vertex_count());
  for (size_t i = 0; i < mesh.triangle_count(); ++i) {
    areas[root_of(parents, mesh.triangles[3 * i])] += length_of(area_vector(mesh, i));
  }
  const double largest_area = *std::max_element(areas.begin(), areas.end());
  uint32_t largest = root_of(parents, mesh.triangles[0]);
  for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
    largest = root_of(parents, mesh.triangles[i]);
    if (areas[largest] == largest_area) break;
  }
  std::vector<uint32_t> numbers(mesh.vertex_count(), std::numeric_limits<uint32_t>::max());
  uint32_t kept = 0;
  for (uint32_t i = 0; i < numbers.size(); ++i) {
    if (root_of(parents, i) == largest) numbers[i] = kept++;
  }
  size_t end = 0;
  for (const uint32_t corner : mesh.triangles) {
    if (numbers[corner] != std::numeric_limits<uint32_t>::max()) mesh.triangles[end++] = numbers[corner];
  }
  mesh.triangles.resize(end);
  for (auto* values : {&mesh.normals, &mesh.template_points, &mesh.texture_coordinates})
    compact(*values, numbers, kept);
  compact(mesh.colours, numbers, kept);
  compact(mesh.positions, numbers, kept);
}

void set_normals(HeadMesh& mesh) {
  std::vector<Vector> sums(mesh.vertex_count());
  for (size_t i = 0; i < mesh.triangle_count(); ++i) {
    const Vector normal = area_vector(mesh, i);
    for (size_t k = 0; k < 3; ++k) {
      for (size_t axis = 0; axis < 3; ++axis) sums[mesh.triangles[3 * i + k]][axis] += normal[axis];
    }
  }
  mesh.normals.resize(mesh.positions.size());
  for (size_t i = 0; i < sums.size(); ++i) {
    const double length = length_of(sums[i]);
    const bool has_any = length > 0 && std::isfinite(length);
    for (size_t axis = 0; axis < 3; ++axis) {
      mesh.normals[3 * i + axis] = has_any ? float(sums[i][axis] / length) : axis == 2 ? 1.0f : 0.0f;
    }
  }
}

void set_normals(HeadMesh& mesh, const GradientField& gradient, WorkerThreads& threads) {
  set_normals(mesh);
  const size_t count = mesh.vertex_count();
  threads.run((count + kFieldBatch - 1) / kFieldBatch, [&](size_t batch, int) {
    const size_t begin = batch * kFieldBatch, size = std::min(kFieldBatch, count - begin);
    std::vector<float> axes(6 * size);
    float* const parts[6] = {axes.data(),
                             axes.data() + size,
                             axes.data() + 2 * size,
                             axes.data() + 3 * size,
                             axes.data() + 4 * size,
                             axes.data() + 5 * size};
    for (size_t i = 0; i < size; ++i) {
      for (size_t axis = 0; axis < 3; ++axis) parts[axis][i] = mesh.positions[3 * (begin + i) + axis];
    }
    gradient(parts[0], parts[1], parts[2], parts[3], parts[4], parts[5], size);
    for (size_t i = 0; i < size; ++i) {
      const double length = length_of({double(parts[3][i]), double(parts[4][i]), double(parts[5][i])});
      if (!(length > 0) || !std::isfinite(length)) continue;
      for (size_t axis = 0; axis < 3; ++axis) {
        mesh.normals[3 * (begin + i) + axis] = float(double(parts[3 + axis][i]) / length);
      }
    }
  });
}

std::vector<uint8_t> find_cap(const HeadMesh& mesh, const std::array<float, 3>& normal, float offset, float tolerance) {
  std::vector<uint8_t> is_cap(mesh.vertex_count());
  for (size_t i = 0; i < is_cap.size(); ++i) {
    const float* const at = &mesh.positions[3 * i];
    is_cap[i] = std::abs(at[0] * normal[0] + at[1] * normal[1] + at[2] * normal[2] - offset) <= tolerance;
  }
  return is_cap;
}

}  // namespace maq::head
