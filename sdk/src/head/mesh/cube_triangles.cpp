#include "head/mesh/cube_triangles.h"

#include <cstddef>
#include <limits>
#include <vector>

namespace maq::head {
namespace {

using Face = std::array<int, 4>;  // corners, counter-clockwise seen from outside of the cell

std::array<Face, 6> cube_faces() {
  std::array<Face, 6> faces{};
  for (int axis = 0; axis < 3; ++axis) {
    const int next = 1 << (axis + 1) % 3, last = 1 << (axis + 2) % 3, far = 1 << axis;
    faces[size_t(2 * axis)] = {0, last, next | last, next};
    faces[size_t(2 * axis + 1)] = {far, far | next, far | next | last, far | last};
  }
  return faces;
}

int edge_between(int a, int b) {
  const int low = a & b, axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  return axis * 4 + (low >> (axis + 1) % 3 & 1) + (low >> (axis + 2) % 3 & 1) * 2;
}

// The bits of the two faces that an edge belongs to.
int faces_of(int edge) {
  const int axis = edge / 4;
  return 1 << (2 * ((axis + 1) % 3) + (edge & 1)) | 1 << (2 * ((axis + 2) % 3) + (edge >> 1 & 1));
}

std::array<int, 3> doubled_middle(int edge) {
  const int corner = first_corner(edge);
  std::array<int, 3> middle{};
  for (int axis = 0; axis < 3; ++axis) middle[size_t(axis)] = axis == edge / 4 ? 1 : (corner >> axis & 1) * 2;
  return middle;
}

// The shortest sides that divide a loop into triangles, none of them within a face.
class LoopTriangles {
 public:
  explicit LoopTriangles(const std::vector<int>& loop) : loop_(loop), size_(int(loop.size())) {
    for (int span = 2; span < size_; ++span) {
      for (int first = 0; first + span < size_; ++first) find(first, first + span);
    }
  }

  void append_to(CubeTriangles& to) const { append(0, size_ - 1, to); }

 private:
  static constexpr int kNever = std::numeric_limits<int>::max() / 4, kMaxSize = 12;

  int side_cost(int i, int j) const {
    if (j - i == 1 || j - i == size_ - 1) return 0;
    if ((faces_of(loop_[size_t(i)]) & faces_of(loop_[size_t(j)])) != 0) return kNever;
    const auto a = doubled_middle(loop_[size_t(i)]), b = doubled_middle(loop_[size_t(j)]);
    int squared = 0;
    for (size_t axis = 0; axis < 3; ++axis) squared += (a[axis] - b[axis]) * (a[axis] - b[axis]);
    return squared;
  }

  // The cost of the polygon from i to j, its side j to i included.
  int cost(int i, int j) const { return j - i < 2 ? 0 : costs_[size_t(i)][size_t(j)]; }

  void find(int i, int j) {
    int best = kNever, apex = i + 1;
    for (int k = i + 1; k < j; ++k) {
      const int sum = cost(i, k) + cost(k, j);
      if (sum < best) best = sum, apex = k;
    }
    const int side = side_cost(i, j);
    costs_[size_t(i)][size_t(j)] = best >= kNever || side >= kNever ? kNever : best + side;
    apexes_[size_t(i)][size_t(j)] = apex;
  }

  void append(int i, int j, CubeTriangles& to) const {
    if (j - i < 2) return;
    const int apex = apexes_[size_t(i)][size_t(j)];
    for (const int corner : {i, apex, j}) to.edges[size_t(to.count++)] = uint8_t(loop_[size_t(corner)]);
    append(i, apex, to);
    append(apex, j, to);
  }

  const std::vector<int>& loop_;
  int size_;
  int costs_[kMaxSize][kMaxSize] = {}, apexes_[kMaxSize][kMaxSize] = {};
};

CubeTriangles triangles_of(int inside, const std::array<Face, 6>& faces) {
  // From each edge of a loop to the next: where a face's border enters a run of corners that are inside, to where it
  // leaves it.
  std::array<int, 12> next;
  next.fill(-1);
  for (const Face& face : faces) {
    const auto is_inside = [&](int i) { return (inside >> face[size_t(i & 3)] & 1) != 0; };
    for (int i = 0; i < 4; ++i) {
      if (!is_inside(i) || is_inside(i + 3)) continue;
      int end = i;
      while (is_inside(end + 1)) ++end;
      next[size_t(edge_between(face[size_t((i + 3) & 3)], face[size_t(i)]))] =
          edge_between(face[size_t(end & 3)], face[size_t((end + 1) & 3)]);
    }
  }
  CubeTriangles made;
  for (int begin = 0; begin < 12; ++begin) {
    std::vector<int> loop;
    for (int edge = begin; next[size_t(edge)] >= 0;) {
      loop.push_back(edge);
      const int following = next[size_t(edge)];
      next[size_t(edge)] = -1;
      edge = following;
    }
    if (!loop.empty()) LoopTriangles(loop).append_to(made);
  }
  made.count /= 3;
  return made;
}

}  // namespace

const std::array<CubeTriangles, 256>& cube_triangles() {
  static const std::array<CubeTriangles, 256> table = [] {
    std::array<CubeTriangles, 256> made{};
    const auto faces = cube_faces();
    for (int inside = 1; inside < 255; ++inside) made[size_t(inside)] = triangles_of(inside, faces);
    return made;
  }();
  return table;
}

}  // namespace maq::head
