#include "sources/synthetic/solids_truth.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "sources/synthetic/solids_rays.h"

namespace maq {
namespace {

constexpr double kBeside = 1e-6;  // metres: nearer to an edge than anything else
constexpr double kMinPiece = 1e-9;
constexpr int kPiecesOfRim = 256;
constexpr double kTwoPi = 6.283185307179586476925286766559;

Vector3 to_world(const Solid& solid, const Vector3& v) {
  return {solid.cosine * v[0] - solid.sine * v[2], v[1], solid.sine * v[0] + solid.cosine * v[2]};
}
Vector3 to_solid(const Solid& solid, const Vector3& v) {
  return {solid.cosine * v[0] + solid.sine * v[2], v[1], solid.cosine * v[2] - solid.sine * v[0]};
}

bool contains(const Solid& solid, const Vector3& point) {
  const Vector3 p = to_solid(solid, point - solid.centre);
  if (std::fabs(p[1]) > solid.half[1]) return false;
  if (solid.radius > 0) return p[0] * p[0] + p[2] * p[2] <= solid.radius * solid.radius;
  return std::fabs(p[0]) <= solid.half[0] && std::fabs(p[2]) <= solid.half[2];
}

// Adds the pieces of a line between two sides of a solid at which the surface of all solids has an edge: between where
// the line goes through the planes of others, space around it is the same all along.
class EdgeCollector {
 public:
  explicit EdgeCollector(const SolidsScene& scene) : scene_(scene) {}

  void add(const Vector3& from, const Vector3& to, const Vector3& first, const Vector3& second) {
    std::vector<double> cuts = {0, 1};
    for (const Solid& solid : scene_.solids) {
      const Vector3 begin = to_solid(solid, from - solid.centre), way = to_solid(solid, to - from);
      for (size_t axis = 0; axis < 3; ++axis) {
        for (const double side : {-solid.half[axis], solid.half[axis]}) {
          const double at = (side - begin[axis]) / way[axis];
          if (at > 0 && at < 1) cuts.push_back(at);
        }
      }
    }
    std::sort(cuts.begin(), cuts.end());
    const size_t first_piece = edges.size();
    for (size_t i = 0; i + 1 < cuts.size(); ++i) {
      if (cuts[i + 1] - cuts[i] < kMinPiece) continue;
      const Vector3 begin = from + cuts[i] * (to - from), end = from + cuts[i + 1] * (to - from);
      add_if_edge({begin, end, {first, second}, false}, 0.5 * (begin + end));
    }
    join(first_piece);
  }

  // `middle` lies on the edge, as the middle of a chord does not.
  void add_if_edge(const SolidsEdge& edge, const Vector3& middle) {
    // The four quarters of the space around an edge: one is solid (convex), or one is free (concave).
    int solid_quarters = 0, last_solid = 0, last_free = 0;
    for (int quarter = 0; quarter < 4; ++quarter) {
      const Vector3 point =
          middle + sign(quarter, 0) * kBeside * edge.normals[0] + sign(quarter, 1) * kBeside * edge.normals[1];
      const bool is_solid = std::any_of(scene_.solids.begin(), scene_.solids.end(),
                                        [&](const Solid& solid) { return contains(solid, point); });
      solid_quarters += is_solid ? 1 : 0;
      (is_solid ? last_solid : last_free) = quarter;
    }
    if (solid_quarters != 1 && solid_quarters != 3) return;
    SolidsEdge found = edge;
    found.is_concave = solid_quarters == 3;
    for (int side = 0; side < 2; ++side) {
      const double outwards = found.is_concave ? sign(last_free, side) : -sign(last_solid, side);
      found.normals[side] = outwards * edge.normals[side];
    }
    edges.push_back(found);
  }

  std::vector<SolidsEdge> edges;

 private:
  static double sign(int quarter, int side) { return (quarter >> side & 1) != 0 ? 1 : -1; }

  // Pieces of one line whose plane between them made no difference.
  void join(size_t first_piece) {
    for (size_t i = edges.size(); i-- > first_piece + 1;) {
      SolidsEdge& before = edges[i - 1];
      const bool is_same = before.is_concave == edges[i].is_concave && before.normals[0] == edges[i].normals[0] &&
                           before.normals[1] == edges[i].normals[1];
      const Vector3 gap = edges[i].from - before.to;
      if (!is_same || dot(gap, gap) > kMinPiece * kMinPiece) continue;
      before.to = edges[i].to;
      edges.erase(edges.begin() + ptrdiff_t(i));
    }
  }

  const SolidsScene& scene_;
};

void add_box(const Solid& box, EdgeCollector& collector) {
  for (size_t along = 0; along < 3; ++along) {
    const size_t a = (along + 1) % 3, b = (along + 2) % 3;
    for (const double side_a : {-1, 1}) {
      for (const double side_b : {-1, 1}) {
        Vector3 from = box.half, first{}, second{};
        from[a] *= side_a;
        from[b] *= side_b;
        Vector3 to = from;
        from[along] *= -1;
        first[a] = side_a;
        second[b] = side_b;
        collector.add(box.centre + to_world(box, from), box.centre + to_world(box, to), to_world(box, first),
                      to_world(box, second));
      }
    }
  }
}

void add_rims(const Solid& cylinder, EdgeCollector& collector) {
  const auto radial = [&](double piece) {
    const double angle = kTwoPi * piece / kPiecesOfRim;
    return to_world(cylinder, {std::cos(angle), 0, std::sin(angle)});
  };
  for (const double end : {-1, 1}) {
    const Vector3 centre = cylinder.centre + Vector3{0, end * cylinder.half[1], 0};
    for (int piece = 0; piece < kPiecesOfRim; ++piece) {
      const Vector3 out = radial(piece + 0.5);
      collector.add_if_edge({centre + cylinder.radius * radial(piece),
                             centre + cylinder.radius * radial(piece + 1),
                             {out, Vector3{0, end, 0}},
                             false},
                            centre + cylinder.radius * out);
    }
  }
}

Vector3 to_camera(const SolidsView& view, const Vector3& v) {
  return {dot(view.axes[0], v), dot(view.axes[1], v), dot(view.axes[2], v)};
}

// An edge in the directions of the camera, and its parts that the camera sees.
class EdgeInView {
 public:
  EdgeInView(const SolidsEdge& edge, const SolidsView& view, const SolidsPicture& picture, const SolidsRays& rays)
      : from_(to_camera(view, edge.from - view.centre)),
        to_(to_camera(view, edge.to - view.centre)),
        picture_(picture),
        rays_(rays) {
    const Vector3 to_eye = view.centre - 0.5 * (edge.from + edge.to);
    const bool sees[2] = {dot(edge.normals[0], to_eye) > 0, dot(edge.normals[1], to_eye) > 0};
    faces_camera_ = edge.is_concave ? sees[0] && sees[1] : sees[0] || sees[1];
    template_.is_concave = edge.is_concave;
    template_.is_boundary = sees[0] != sees[1];
  }

  void add_visible(std::vector<VisibleSolidsEdge>& parts) const {
    double begin = 0, end = 1;
    if (!faces_camera_ || !clip(begin, end)) return;
    // Steps of the same length in the image.
    const Vector3 a = point(begin), b = point(end);
    const double across = a[0] / a[2] - b[0] / b[2], down = a[1] / a[2] - b[1] / b[2];
    const int steps = 2 + int(4 * picture_.focal_px() * std::sqrt(across * across + down * down));
    const auto at = [&](int step) {
      const double s = (step + 0.5) / steps;
      return begin + (end - begin) * s * a[2] / (s * a[2] + (1 - s) * b[2]);
    };
    double since = begin, before = begin;
    bool was_visible = is_visible(at(0));
    for (int step = 0; step < steps; ++step) {
      const double now = at(step);
      const bool visible = is_visible(now);
      if (visible != was_visible) {
        const double change = change_between(before, now, was_visible);
        if (was_visible) add_part(since, change, parts);
        since = change;
        was_visible = visible;
      }
      before = now;
    }
    if (was_visible) add_part(since, end, parts);
  }

 private:
  Vector3 point(double at) const { return from_ + at * (to_ - from_); }

  // Clips to the part in front of the camera and between the borders of the image.
  bool clip(double& begin, double& end) const {
    constexpr double kNear = 1e-3;
    const double focal = picture_.focal_px(), x = picture_.centre_x_px(), y = picture_.centre_y_px();
    const auto keep = [&](const Vector3& plane, double offset) {  // where plane * p >= offset
      const double a = dot(plane, from_) - offset, b = dot(plane, to_) - offset;
      if (a < 0) begin = std::max(begin, b < 0 ? 1 : a / (a - b));
      if (b < 0) end = std::min(end, a < 0 ? 0 : a / (a - b));
    };
    keep({0, 0, 1}, kNear);
    keep({focal, 0, x + 0.5}, 0);
    keep({-focal, 0, picture_.width_px - 0.5 - x}, 0);
    keep({0, focal, y + 0.5}, 0);
    keep({0, -focal, picture_.height_px - 0.5 - y}, 0);
    return begin < end;
  }

  bool is_visible(double at) const {
    constexpr double kTolerance = 1e-9;
    const Vector3 p = point(at);
    return rays_.depth(p[0] / p[2], p[1] / p[2]) > p[2] * (1 - kTolerance);
  }

  double change_between(double before, double after, bool was_visible) const {
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (before + after);
      (is_visible(middle) == was_visible ? before : after) = middle;
    }
    return 0.5 * (before + after);
  }

  void add_part(double begin, double end, std::vector<VisibleSolidsEdge>& parts) const {
    VisibleSolidsEdge part = template_;
    part.from = point(begin);
    part.to = point(end);
    parts.push_back(part);
  }

  Vector3 from_, to_;
  const SolidsPicture& picture_;
  const SolidsRays& rays_;
  bool faces_camera_ = false;
  VisibleSolidsEdge template_;
};

}  // namespace

std::vector<SolidsEdge> solids_edges(const SolidsScene& scene) {
  EdgeCollector collector(scene);
  for (const Solid& solid : scene.solids) {
    if (solid.radius > 0) {
      add_rims(solid, collector);
    } else {
      add_box(solid, collector);
    }
  }
  return std::move(collector.edges);
}

std::vector<VisibleSolidsEdge> visible_solids_edges(const SolidsScene& scene, const SolidsView& view,
                                                    const SolidsPicture& picture) {
  const SolidsRays rays(scene, view);
  std::vector<VisibleSolidsEdge> parts;
  for (const SolidsEdge& edge : solids_edges(scene)) EdgeInView(edge, view, picture, rays).add_visible(parts);
  return parts;
}

}  // namespace maq
