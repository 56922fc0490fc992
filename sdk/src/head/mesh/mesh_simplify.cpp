#include "head/mesh/mesh_simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <queue>

#include "core/math/vec3.h"

namespace maq::head {
namespace {

constexpr uint32_t kNoCorner = std::numeric_limits<uint32_t>::max();
// A triangle may turn by a collapse as long as the cosine is larger: folds cannot come of it.
constexpr double kMinTurnCosine = 0.3;
// Where the surface is flat all collapses cost nothing; a small share of the edge's length, squared, makes them even.
constexpr double kLengthFraction = 3e-6;
// Holds a vertex near the edge's middle in the directions that planes leave free.
constexpr double kMiddleFraction = 1e-3;

// The sum of weights times squared distances from planes: p'Ap + 2b'p + c, A symmetric.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, c = 0;
  Vec3 b;

  void add(Vec3 normal, double offset, double weight) {
    xx += weight * normal.x * normal.x, xy += weight * normal.x * normal.y, xz += weight * normal.x * normal.z;
    yy += weight * normal.y * normal.y, yz += weight * normal.y * normal.z, zz += weight * normal.z * normal.z;
    b = b + (weight * offset) * normal;
    c += weight * offset * offset;
  }

  void add(const Quadric& other) {
    xx += other.xx, xy += other.xy, xz += other.xz, yy += other.yy, yz += other.yz, zz += other.zz, c += other.c;
    b = b + other.b;
  }

  double trace() const { return xx + yy + zz; }
  Vec3 times(Vec3 p) const {
    return {xx * p.x + xy * p.y + xz * p.z, xy * p.x + yy * p.y + yz * p.z, xz * p.x + yz * p.y + zz * p.z};
  }
  double at(Vec3 p) const { return std::max(0.0, dot(p, times(p)) + 2 * dot(b, p) + c); }

  // Where it is least, held near `middle`.
  Vec3 min_near(Vec3 middle) const {
    const double hold = kMiddleFraction * trace();
    if (!(hold > 0)) return middle;
    const Vec3 r0{xx + hold, xy, xz}, r1{xy, yy + hold, yz}, r2{xz, yz, zz + hold};
    const Vec3 right = -(times(middle) + b);
    const Vec3 c0 = cross(r1, r2), c1 = cross(r2, r0), c2 = cross(r0, r1);
    const double determinant = dot(r0, c0);
    if (!(determinant > 0)) return middle;
    return middle + (1 / determinant) * (right.x * c0 + right.y * c1 + right.z * c2);
  }
};

struct Collapse {
  double cost = 0;
  uint32_t from = 0, to = 0;  // from > to: the vertex `to` stays
  uint32_t age = 0;           // of both when this was found out

  bool operator<(const Collapse& other) const {  // the queue gives the largest first
    return cost != other.cost ? cost > other.cost : to != other.to ? to > other.to : from > other.from;
  }
};

class Simplifier {
 public:
  explicit Simplifier(const HeadMesh& mesh)
      : triangles_(mesh.triangles),
        points_(mesh.vertex_count()),
        quadrics_(points_.size()),
        first_corner_(points_.size(), kNoCorner),
        next_corner_(triangles_.size(), kNoCorner),
        ages_(points_.size()),
        marks_(points_.size()),
        left_(mesh.triangle_count()) {
    for (size_t i = 0; i < points_.size(); ++i) {
      const float* const p = &mesh.positions[3 * i];
      points_[i] = {double(p[0]), double(p[1]), double(p[2])};
    }
    for (size_t corner = triangles_.size(); corner-- > 0;) {
      next_corner_[corner] = first_corner_[triangles_[corner]];
      first_corner_[triangles_[corner]] = uint32_t(corner);
    }
    for (size_t i = 0; i < triangles_.size(); i += 3) {
      const Vec3 p = points_[triangles_[i]];
      const Vec3 across = cross(points_[triangles_[i + 1]] - p, points_[triangles_[i + 2]] - p);
      // Between all planes alike and by area: the largest error is less than with either.
      const double weight = std::sqrt(length(across) / 2);
      const Vec3 normal = normalized(across);
      for (size_t k = 0; k < 3; ++k) quadrics_[triangles_[i + k]].add(normal, -dot(normal, p), weight);
    }
    std::vector<Collapse> found;
    found.reserve(triangles_.size() / 2);
    for (size_t corner = 0; corner < triangles_.size(); ++corner) {
      const uint32_t a = triangles_[corner], b = triangles_[corner / 3 * 3 + (corner + 1) % 3];
      if (a < b) found.push_back(collapse_of(a, b));
    }
    queue_ = std::priority_queue<Collapse>(std::less<Collapse>(), std::move(found));
  }

  void run(size_t triangles) {
    while (left_ > triangles && !queue_.empty()) {
      const Collapse next = queue_.top();
      queue_.pop();
      if (next.age != age_of(next.to, next.from)) continue;
      const Vec3 place = place_of(next.to, next.from);
      if (is_allowed(next.to, next.from, place)) collapse(next.to, next.from, place);
    }
  }

  void write(HeadMesh& mesh) const {
    mesh = {};
    std::vector<uint32_t> numbers(points_.size(), kNoCorner);
    for (size_t corner = 0; corner < triangles_.size(); ++corner) {
      if (is_gone(corner)) continue;
      numbers[triangles_[corner]] = 0;
    }
    for (size_t i = 0; i < points_.size(); ++i) {
      if (numbers[i] == kNoCorner) continue;
      numbers[i] = uint32_t(mesh.vertex_count());
      for (const double value : {points_[i].x, points_[i].y, points_[i].z}) mesh.positions.push_back(float(value));
    }
    mesh.triangles.reserve(3 * left_);
    for (size_t corner = 0; corner < triangles_.size(); ++corner) {
      if (!is_gone(corner)) mesh.triangles.push_back(numbers[triangles_[corner]]);
    }
  }

 private:
  // Two corners of a triangle that is gone are the same.
  bool is_gone(size_t corner) const {
    const uint32_t* const t = &triangles_[corner / 3 * 3];
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
  }

  uint32_t age_of(uint32_t a, uint32_t b) const { return ages_[a] + ages_[b]; }

  // Calls use(corner) for each of a vertex, of triangles that are there.
  template <class Use>
  void for_corners(uint32_t vertex, Use&& use) const {
    for (uint32_t corner = first_corner_[vertex]; corner != kNoCorner; corner = next_corner_[corner]) {
      if (!is_gone(corner)) use(size_t(corner));
    }
  }

  uint32_t beside(size_t corner, size_t step) const { return triangles_[corner / 3 * 3 + (corner + step) % 3]; }

  Vec3 place_of(uint32_t a, uint32_t b) const {
    Quadric both = quadrics_[a];
    both.add(quadrics_[b]);
    return both.min_near(0.5 * (points_[a] + points_[b]));
  }

  Collapse collapse_of(uint32_t a, uint32_t b) const {
    Quadric both = quadrics_[a];
    both.add(quadrics_[b]);
    const Vec3 along = points_[b] - points_[a];
    const double cost =
        both.at(both.min_near(0.5 * (points_[a] + points_[b]))) + kLengthFraction * both.trace() * dot(along, along);
    return {cost, std::max(a, b), std::min(a, b), age_of(a, b)};
  }

  // Whether the mesh stays a manifold (the link condition: both ends have only the two vertices beside the edge in
  // common) and no triangle turns over.
  bool is_allowed(uint32_t to, uint32_t from, Vec3 place) {
    if (left_ <= 4) return false;
    ++mark_;
    for_corners(to, [&](size_t corner) { marks_[beside(corner, 1)] = marks_[beside(corner, 2)] = mark_; });
    if (marks_[from] != mark_) return false;
    size_t common = 0;
    for_corners(from, [&](size_t corner) {
      common += marks_[beside(corner, 1)] == mark_;  // in a closed fan each neighbour is the next once
    });
    if (common != 2) return false;
    return keeps_facing(to, from, place) && keeps_facing(from, to, place);
  }

  bool keeps_facing(uint32_t moved, uint32_t other, Vec3 place) const {
    bool is_kept = true;
    for_corners(moved, [&](size_t corner) {
      const uint32_t a = beside(corner, 1), b = beside(corner, 2);
      if (a == other || b == other) return;
      const Vec3 before = cross(points_[a] - points_[moved], points_[b] - points_[moved]);
      const Vec3 after = cross(points_[a] - place, points_[b] - place);
      if (!(dot(before, after) > kMinTurnCosine * length(before) * length(after))) is_kept = false;
    });
    return is_kept;
  }

  void collapse(uint32_t to, uint32_t from, Vec3 place) {
    points_[to] = place;
    quadrics_[to].add(quadrics_[from]);
    ages_[to] += ages_[from] + 1;
    uint32_t last = first_corner_[to];
    while (next_corner_[last] != kNoCorner) last = next_corner_[last];
    next_corner_[last] = first_corner_[from];
    for (uint32_t corner = first_corner_[from]; corner != kNoCorner; corner = next_corner_[corner]) {
      triangles_[corner] = to;
    }
    first_corner_[from] = kNoCorner;
    left_ -= 2;
    drop_gone_corners(to);
    for_corners(to, [&](size_t corner) { queue_.push(collapse_of(to, beside(corner, 1))); });
  }

  void drop_gone_corners(uint32_t vertex) {
    uint32_t* link = &first_corner_[vertex];
    while (*link != kNoCorner) {
      if (is_gone(*link)) {
        *link = next_corner_[*link];
      } else {
        link = &next_corner_[*link];
      }
    }
  }

  std::vector<uint32_t> triangles_;
  std::vector<Vec3> points_;
  std::vector<Quadric> quadrics_;
  std::vector<uint32_t> first_corner_, next_corner_;  // lists of each vertex's corners
  std::vector<uint32_t> ages_;                        // how often a vertex changed; grows with each change
  std::vector<uint32_t> marks_;
  uint32_t mark_ = 0;
  size_t left_;
  std::priority_queue<Collapse> queue_;
};

// The squared distance of a point from a triangle (Ericson, Real-time collision detection, 2005, 5.1.5).
double squared_distance(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const auto to = [&](Vec3 nearest) { return dot(p - nearest, p - nearest); };
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return to(a);
  const double d3 = dot(ab, p - b), d4 = dot(ac, p - b);
  if (d3 >= 0 && d4 <= d3) return to(b);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return to(a + (d1 / std::max(d1 - d3, 1e-300)) * ab);
  const double d5 = dot(ab, p - c), d6 = dot(ac, p - c);
  if (d6 >= 0 && d5 <= d6) return to(c);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return to(a + (d2 / std::max(d2 - d6, 1e-300)) * ac);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    return to(b + ((d4 - d3) / std::max(d4 - d3 + d5 - d6, 1e-300)) * (c - b));
  }
  const double sum = va + vb + vc;
  return sum > 0 ? to(a + (vb / sum) * ab + (vc / sum) * ac) : to(a);
}

// Triangles by the cubes of a grid that their boxes reach.
class TriangleGrid {
 public:
  explicit TriangleGrid(const HeadMesh& mesh) : mesh_(mesh) {
    std::array<double, 3> high{};
    for (size_t axis = 0; axis < 3; ++axis) {
      low_[axis] = high[axis] = double(mesh.positions[axis]);
      for (size_t i = axis; i < mesh.positions.size(); i += 3) {
        low_[axis] = std::min(low_[axis], double(mesh.positions[i]));
        high[axis] = std::max(high[axis], double(mesh.positions[i]));
      }
    }
    const double longest = std::max({high[0] - low_[0], high[1] - low_[1], high[2] - low_[2], 1e-9});
    // Some two triangles of a head's surface in each cube that has any.
    const double cubes = std::clamp(std::sqrt(double(mesh.triangle_count()) / 6), 1.0, 128.0);
    side_ = longest / cubes;
    for (size_t axis = 0; axis < 3; ++axis) size_[axis] = int((high[axis] - low_[axis]) / side_) + 1;
    starts_.assign(size_t(size_[0]) * size_t(size_[1]) * size_t(size_[2]) + 1, 0);
    for (size_t i = 0; i < mesh.triangle_count(); ++i) for_cubes(i, [&](size_t cube) { ++starts_[cube + 1]; });
    for (size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
    triangles_.resize(starts_.back());
    std::vector<uint32_t> ends(starts_.begin(), starts_.end() - 1);
    for (size_t i = 0; i < mesh.triangle_count(); ++i) {
      for_cubes(i, [&](size_t cube) { triangles_[ends[cube]++] = uint32_t(i); });
    }
  }

  double squared_distance_to(Vec3 p) const {
    const std::array<double, 3> at{p.x, p.y, p.z};
    std::array<int, 3> middle{};
    for (size_t axis = 0; axis < 3; ++axis) {
      const double cube = (at[axis] - low_[axis]) / side_;
      middle[axis] = std::clamp(int(std::floor(std::clamp(cube, -1.0, double(size_[axis])))), 0, size_[axis] - 1);
    }
    double best = std::numeric_limits<double>::infinity();
    const int reach = std::max({size_[0], size_[1], size_[2]});
    for (int shell = 0; shell <= reach; ++shell) {
      // The rest is at least this far away, also from a point outside of the grid, whose nearest position in the grid
      // is in the middle.
      const double beyond = std::max(0, shell - 1) * side_;
      if (beyond * beyond >= best) break;
      for_shell(middle, shell, [&](size_t cube) {
        for (uint32_t i = starts_[cube]; i < starts_[cube + 1]; ++i) best = std::min(best, squared(p, triangles_[i]));
      });
    }
    return best;
  }

 private:
  Vec3 corner(size_t triangle, size_t k) const {
    const float* const p = &mesh_.positions[3 * size_t(mesh_.triangles[3 * triangle + k])];
    return {double(p[0]), double(p[1]), double(p[2])};
  }
  double squared(Vec3 p, size_t triangle) const {
    return squared_distance(p, corner(triangle, 0), corner(triangle, 1), corner(triangle, 2));
  }
  size_t cube_at(int x, int y, int z) const {
    return (size_t(z) * size_t(size_[1]) + size_t(y)) * size_t(size_[0]) + size_t(x);
  }

  template <class Use>
  void for_cubes(size_t triangle, Use&& use) const {
    std::array<int, 3> first{}, last{};
    for (size_t axis = 0; axis < 3; ++axis) {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (size_t k = 0; k < 3; ++k) {
        const double value = double(mesh_.positions[3 * size_t(mesh_.triangles[3 * triangle + k]) + axis]);
        low = std::min(low, value), high = std::max(high, value);
      }
      first[axis] = std::clamp(int((low - low_[axis]) / side_), 0, size_[axis] - 1);
      last[axis] = std::clamp(int((high - low_[axis]) / side_), 0, size_[axis] - 1);
    }
    for (int z = first[2]; z <= last[2]; ++z) {
      for (int y = first[1]; y <= last[1]; ++y) {
        for (int x = first[0]; x <= last[0]; ++x) use(cube_at(x, y, z));
      }
    }
  }

  // The cubes at this distance of the middle, in cubes along the axis where it is farthest.
  template <class Use>
  void for_shell(const std::array<int, 3>& middle, int shell, Use&& use) const {
    const auto from = [&](size_t axis) { return std::max(0, middle[axis] - shell); };
    const auto to = [&](size_t axis) { return std::min(size_[axis] - 1, middle[axis] + shell); };
    for (int z = from(2); z <= to(2); ++z) {
      for (int y = from(1); y <= to(1); ++y) {
        const bool is_side = std::abs(z - middle[2]) == shell || std::abs(y - middle[1]) == shell;
        const int step = is_side || shell == 0 ? 1 : 2 * shell;
        for (int x = is_side ? from(0) : middle[0] - shell; x <= to(0); x += step) {
          if (x >= 0) use(cube_at(x, y, z));
        }
      }
    }
  }

  const HeadMesh& mesh_;
  std::array<double, 3> low_{};
  std::array<int, 3> size_{};
  double side_ = 1;
  std::vector<uint32_t> starts_, triangles_;  // of each cube
};

}  // namespace

void simplify_mesh(HeadMesh& mesh, size_t triangles) {
  if (mesh.triangle_count() <= triangles) return;
  Simplifier simplifier(mesh);
  simplifier.run(triangles);
  simplifier.write(mesh);
}

double largest_distance(const std::vector<float>& points, const HeadMesh& mesh, WorkerThreads& threads) {
  constexpr size_t kPointsOfTask = 1024;
  const TriangleGrid grid(mesh);
  const size_t count = points.size() / 3, tasks = (count + kPointsOfTask - 1) / kPointsOfTask;
  std::vector<double> largest(tasks);
  threads.run(tasks, [&](size_t task, int) {
    for (size_t i = task * kPointsOfTask; i < std::min((task + 1) * kPointsOfTask, count); ++i) {
      const float* const p = &points[3 * i];
      largest[task] = std::max(largest[task], grid.squared_distance_to({double(p[0]), double(p[1]), double(p[2])}));
    }
  });
  return tasks > 0 ? std::sqrt(*std::max_element(largest.begin(), largest.end())) : 0;
}

}  // namespace maq::head
