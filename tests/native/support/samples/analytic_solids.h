// Boxes and cylinders seen by a pinhole camera, with their exact depth, distance to sharp curves, and the curves that
// are seen: the truth that extraction is measured against.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "edges/curves/edge_curves.h"

namespace maq::test {

inline constexpr double kPi = 3.141592653589793;

// A flat polygon in origin + a u + b v, or a part of a cylinder's side around `axis`. Faces of one patch are joined
// smoothly: no curve lies between them.
struct SolidFace {
  int patch = 0;
  bool is_tube = false;
  Vec3 origin, u, v, normal;  // of a tube: u, v across the axis, normal = the axis
  std::vector<std::array<double, 2>> polygon;
  double radius = 0, height = 0, from_rad = 0, sweep_rad = 2 * kPi;

  Vec3 normal_at(Vec3 p) const {
    if (!is_tube) return normal;
    const Vec3 d = p - origin;
    return normalized(d - dot(d, normal) * normal);
  }

  bool contains(double a, double b) const {
    bool inside = false;
    for (size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
      const auto &p = polygon[i], &q = polygon[j];
      if ((p[1] > b) != (q[1] > b) && a < (q[0] - p[0]) * (b - p[1]) / (q[1] - p[1]) + p[0]) inside = !inside;
    }
    return inside;
  }

  // How many times `ray` reaches from the origin to the face; infinite where it misses.
  double hit(Vec3 ray) const {
    if (!is_tube) {
      const double t = dot(origin, normal) / dot(ray, normal);
      if (!(t > 0)) return INFINITY;
      const Vec3 d = t * ray - origin;
      return contains(dot(d, u), dot(d, v)) ? t : INFINITY;
    }
    const Vec3 across = ray - dot(ray, normal) * normal, start = -origin + dot(origin, normal) * normal;
    const double a = dot(across, across), b = dot(across, start), c = dot(start, start) - radius * radius;
    const double root = b * b - a * c;
    if (!(root >= 0)) return INFINITY;
    for (const double sign : {-1.0, 1.0}) {
      const double t = (-b + sign * std::sqrt(root)) / a;
      if (!(t > 0)) continue;
      const Vec3 d = t * ray - origin;
      const double along = dot(d, normal), angle = std::atan2(dot(d, v), dot(d, u)) - from_rad;
      const double turned = angle - 2 * kPi * std::floor(angle / (2 * kPi));
      if (along >= 0 && along <= height && turned <= sweep_rad) return t;
    }
    return INFINITY;
  }
};

// A segment, or an arc centre + x cos a + y sin a; faces: those that meet in it.
struct SolidCurve {
  bool is_arc = false;
  Vec3 a, b;  // of an arc: centre
  Vec3 x, y;
  double sweep_rad = 0;
  std::array<int, 2> face;

  Vec3 at(double t) const {
    if (!is_arc) return a + t * (b - a);
    return a + std::cos(t * sweep_rad) * x + std::sin(t * sweep_rad) * y;
  }
  double distance(Vec3 p, double from, double to) const {
    if (!is_arc) {
      const Vec3 d = b - a;
      return length(p - at(std::clamp(dot(p - a, d) / dot(d, d), from, to)));
    }
    const Vec3 d = p - a;
    const double middle = sweep_rad * (from + to) / 2, half = sweep_rad * (to - from) / 2;
    const double off = std::remainder(std::atan2(dot(d, y), dot(d, x)) - middle, 2 * kPi);
    return length(p - at((middle + std::clamp(off, -half, half)) / sweep_rad));
  }
};

struct SeenPiece {
  int curve;
  double from, to;
  EdgeKind kind;
};

struct SolidScene {
  std::vector<SolidFace> faces;  // camera coordinates, once seen_from() was called
  std::vector<SolidCurve> curves;
  int patches = 0;

  int add_polygon(const std::vector<Vec3>& corners, Vec3 outward, int patch = -1) {
    SolidFace face;
    face.patch = patch < 0 ? patches++ : patch;
    face.origin = corners[0];
    face.normal = normalized(outward);
    face.u = normalized(corners[1] - corners[0]);
    face.v = cross(face.normal, face.u);
    for (const Vec3& c : corners) face.polygon.push_back({dot(c - corners[0], face.u), dot(c - corners[0], face.v)});
    faces.push_back(face);
    return int(faces.size()) - 1;
  }
  void add_line(Vec3 a, Vec3 b, int face, int other) {
    SolidCurve curve;
    curve.a = a, curve.b = b;
    curve.face = {face, other};
    curves.push_back(curve);
  }
  void add_arc(Vec3 centre, Vec3 x, Vec3 y, double sweep_rad, int face, int other) {
    SolidCurve curve;
    curve.is_arc = true;
    curve.a = centre, curve.x = x, curve.y = y;
    curve.sweep_rad = sweep_rad;
    curve.face = {face, other};
    curves.push_back(curve);
  }

  // World: z up. `on`: the face that the box stands on, or -1. Returns its top face.
  int add_box(Vec3 foot, Vec3 size, double turn_rad, int on) {
    const Vec3 ex{std::cos(turn_rad), std::sin(turn_rad), 0}, ey{-std::sin(turn_rad), std::cos(turn_rad), 0};
    const Vec3 x = size.x / 2 * ex, y = size.y / 2 * ey, up{0, 0, size.z};
    const Vec3 ring[4] = {foot - x - y, foot + x - y, foot + x + y, foot - x + y};
    const Vec3 out[4] = {-ey, ex, ey, -ex};
    int side[4];
    for (int i = 0; i < 4; ++i) {
      const Vec3 a = ring[i], b = ring[(i + 1) % 4];
      side[i] = add_polygon({a, b, b + up, a + up}, out[i]);
    }
    const int top = add_polygon({ring[0] + up, ring[1] + up, ring[2] + up, ring[3] + up}, {0, 0, 1});
    const int bottom = on >= 0 ? on : add_polygon({ring[0], ring[1], ring[2], ring[3]}, {0, 0, -1});
    for (int i = 0; i < 4; ++i) {
      const Vec3 a = ring[i], b = ring[(i + 1) % 4];
      add_line(a, b, side[i], bottom);
      add_line(a + up, b + up, side[i], top);
      add_line(b, b + up, side[i], side[(i + 1) % 4]);
    }
    return top;
  }

  void add_cylinder(Vec3 foot, double radius, double height, int on) {
    const int patch = patches++;
    SolidFace tube;
    tube.patch = patch, tube.is_tube = true;
    tube.origin = foot, tube.u = {1, 0, 0}, tube.v = {0, 1, 0}, tube.normal = {0, 0, 1};
    tube.radius = radius, tube.height = height;
    faces.push_back(tube);
    const int side = int(faces.size()) - 1;
    std::vector<Vec3> ring;
    const Vec3 up{0, 0, height};
    for (int i = 0; i < 720; ++i) {
      ring.push_back(foot + up + Vec3{radius * std::cos(i * kPi / 360), radius * std::sin(i * kPi / 360), 0});
    }
    const int top = add_polygon(ring, {0, 0, 1});
    add_arc(foot + up, {radius, 0, 0}, {0, radius, 0}, 2 * kPi, side, top);
    add_arc(foot, {radius, 0, 0}, {0, radius, 0}, 2 * kPi, side, on);
  }

  // A box whose upper front edge (towards -y) is rounded: top, rounding and front are one patch.
  void add_rounded_box(Vec3 foot, Vec3 size, double radius, int on) {
    const Vec3 x{size.x / 2, 0, 0}, y{0, size.y / 2, 0}, up{0, 0, size.z}, r_up{0, 0, radius}, r_in{0, radius, 0};
    const Vec3 l = foot - x, r = foot + x;
    const int front = add_polygon({l - y, r - y, r - y + up - r_up, l - y + up - r_up}, {0, -1, 0});
    const int patch = faces[size_t(front)].patch;
    const int top = add_polygon({l - y + up + r_in, r - y + up + r_in, r + y + up, l + y + up}, {0, 0, 1}, patch);
    SolidFace tube;
    tube.patch = patch, tube.is_tube = true;
    tube.origin = l - y + up + r_in - r_up, tube.normal = {1, 0, 0}, tube.u = {0, -1, 0}, tube.v = {0, 0, 1};
    tube.radius = radius, tube.height = size.x, tube.sweep_rad = kPi / 2;
    faces.push_back(tube);
    const int rounding = int(faces.size()) - 1;
    const int back = add_polygon({l + y, r + y, r + y + up, l + y + up}, {0, 1, 0});
    for (const double sign : {-1.0, 1.0}) {
      const Vec3 at = sign < 0 ? l : r, centre = at - y + up + r_in - r_up;
      std::vector<Vec3> outline{at + y, at - y};
      for (int i = 0; i <= 90; ++i) {
        const double a = i * kPi / 180;
        outline.push_back(centre + Vec3{0, -radius * std::cos(a), radius * std::sin(a)});
      }
      outline.push_back(at + y + up);
      const int cap = add_polygon(outline, {sign, 0, 0});
      add_line(at - y, at - y + up - r_up, cap, front);
      add_arc(centre, {0, -radius, 0}, {0, 0, radius}, kPi / 2, cap, rounding);
      add_line(at - y + up + r_in, at + y + up, cap, top);
      add_line(at + y + up, at + y, cap, back);
      add_line(at + y, at - y, cap, on);
    }
    add_line(l - y, r - y, front, on);
    add_line(l + y, r + y, back, on);
    add_line(l + y + up, r + y + up, back, top);
  }

  // From world to the coordinates of a camera at `eye` that looks at `target`, upright.
  void seen_from(Vec3 eye, Vec3 target) {
    const Vec3 z = normalized(target - eye), x = normalized(cross(z, {0, 0, 1})), y = cross(z, x);
    const auto turn = [&](Vec3 d) { return Vec3{dot(d, x), dot(d, y), dot(d, z)}; };
    for (SolidFace& face : faces) {
      face.origin = turn(face.origin - eye);
      face.u = turn(face.u), face.v = turn(face.v), face.normal = turn(face.normal);
    }
    for (SolidCurve& curve : curves) {
      curve.a = turn(curve.a - eye), curve.b = turn(curve.b - eye);
      curve.x = turn(curve.x), curve.y = turn(curve.y);
    }
  }

  void scale(double by) {
    for (SolidFace& face : faces) {
      face.origin = by * face.origin;
      face.radius *= by, face.height *= by;
      for (auto& p : face.polygon) p = {by * p[0], by * p[1]};
    }
    for (SolidCurve& curve : curves) {
      curve.a = by * curve.a, curve.b = by * curve.b, curve.x = by * curve.x, curve.y = by * curve.y;
    }
  }

  double cast(Vec3 ray, int* face = nullptr) const {
    double nearest = INFINITY;
    for (size_t i = 0; i < faces.size(); ++i) {
      const double t = faces[i].hit(ray);
      if (!(t < nearest)) continue;
      nearest = t;
      if (face != nullptr) *face = int(i);
    }
    return nearest;
  }
};

struct SeenScene {
  SolidScene scene;
  EdgeField field;
  std::vector<SeenPiece> pieces;
  std::vector<int> patch;     // of each pixel, -1: nothing is there
  std::vector<Vec3> samples;  // every half pixel of the pieces
  std::vector<EdgeKind> sample_kinds;
};

inline Intrinsics camera_of(int width, int height, double focal_px) {
  Intrinsics camera;
  camera.width_px = width, camera.height_px = height;
  camera.fx_px = camera.fy_px = focal_px;
  camera.cx_px = (width - 1) / 2.0, camera.cy_px = (height - 1) / 2.0;
  return camera;
}

// 0: not seen, else the EdgeKind of a place of a curve.
inline int seen_kind(const SolidScene& scene, const SolidCurve& curve, double t, const Intrinsics& camera) {
  const Vec3 p = curve.at(t);
  if (!(p.z > 1e-6)) return 0;
  const double x = camera.fx_px * p.x / p.z + camera.cx_px, y = camera.fy_px * p.y / p.z + camera.cy_px;
  if (x < -0.5 || y < -0.5 || x > camera.width_px - 0.5 || y > camera.height_px - 0.5) return 0;
  Vec3 out;
  int facing = 0;
  for (const int face : curve.face) {
    const Vec3 n = scene.faces[size_t(face)].normal_at(p);
    if (dot(n, p) >= 0) continue;
    ++facing;
    out = out + n;
  }
  if (facing == 0) return 0;
  const double r = p.z / camera.fx_px;
  const Vec3 lifted = p + 0.05 * r * normalized(out);
  if (scene.cast((1 / lifted.z) * lifted) < lifted.z - 0.1 * r) return 0;
  return facing == 2 ? kCreaseEdge : kBoundaryEdge;
}

inline SeenScene see(SolidScene scene, const Intrinsics& camera, double eps_r = 16) {
  SeenScene seen;
  for (size_t c = 0; c < scene.curves.size(); ++c) {
    const SolidCurve& curve = scene.curves[c];
    const int steps = 4000;
    double since = 1;
    Vec3 before;
    int state = 0;
    for (int i = 0; i <= steps; ++i) {
      const double t = double(i) / steps;
      const int kind = seen_kind(scene, curve, t, camera);
      if (kind != state && kind != 0) seen.pieces.push_back({int(c), t, t, EdgeKind(kind)});
      if (kind != 0) seen.pieces.back().to = t;
      state = kind;
      const Vec3 p = curve.at(t);
      if (kind == 0) continue;
      since += length(p - before) / (p.z / camera.fx_px);
      before = p;
      if (since < 0.5) continue;
      since = 0;
      seen.samples.push_back(p);
      seen.sample_kinds.push_back(EdgeKind(kind));
    }
  }
  EdgeField& field = seen.field;
  field.width = camera.width_px, field.height = camera.height_px;
  field.intrinsics = camera;
  field.eps_r = float(eps_r);
  const size_t pixels = size_t(field.width) * size_t(field.height);
  field.distance_r.assign(pixels, float(eps_r));
  field.expected_error_r.assign(pixels, 0);
  field.kind.assign(pixels, kNoEdge);
  field.depth_m.assign(pixels, 0);
  seen.patch.assign(pixels, -1);
  for (int y = 0; y < field.height; ++y) {
    for (int x = 0; x < field.width; ++x) {
      const Vec3 ray{(x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, 1};
      int face = -1;
      const double depth = scene.cast(ray, &face);
      if (face < 0) continue;
      const size_t at = size_t(y) * size_t(field.width) + size_t(x);
      field.depth_m[at] = float(depth);
      seen.patch[at] = scene.faces[size_t(face)].patch;
      double best = eps_r;
      for (const SeenPiece& piece : seen.pieces) {
        const SolidCurve& curve = scene.curves[size_t(piece.curve)];
        if (scene.faces[size_t(curve.face[0])].patch != seen.patch[at] &&
            scene.faces[size_t(curve.face[1])].patch != seen.patch[at]) {
          continue;
        }
        const double d = curve.distance(depth * ray, piece.from, piece.to) * camera.fx_px / depth;
        if (!(d < best)) continue;
        best = d;
        field.kind[at] = piece.kind;
      }
      field.distance_r[at] = float(best);
    }
  }
  seen.scene = std::move(scene);
  return seen;
}

// Errors of networks and cameras: the field blurred (px) and with noise (r), depth near edges mixed from both sides,
// and with noise (r along the ray).
struct Damage {
  double blur_px = 0, noise_r = 0;
  bool blurs_over_jumps = false;  // where a surface ends: mixes in what the field is beyond
  int flying_pixel_band_px = 0;
  double depth_noise_r = 0;
};

inline void damage(SeenScene& seen, const Damage& by, unsigned seed) {
  EdgeField& field = seen.field;
  const int w = field.width, h = field.height;
  std::mt19937 bits(seed);
  const auto uniform = [&] { return (double(bits()) + 0.5) / 4294967296.0; };
  const auto normal = [&] { return std::sqrt(-2 * std::log(uniform())) * std::cos(2 * kPi * uniform()); };
  const auto at = [&](int x, int y) {
    return size_t(std::clamp(y, 0, h - 1)) * size_t(w) + size_t(std::clamp(x, 0, w - 1));
  };
  if (by.blur_px > 0) {
    for (const bool is_row : {true, false}) {
      const auto before = field.distance_r;
      for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
          double sum = 0, weight = 0;
          for (int k = -3; k <= 3; ++k) {
            const size_t other = is_row ? at(x + k, y) : at(x, y + k);
            const bool is_mixed = by.blurs_over_jumps || seen.patch[other] == seen.patch[at(x, y)];
            const double g = is_mixed ? std::exp(-k * k / (2 * by.blur_px * by.blur_px)) : 0;
            sum += g * before[other], weight += g;
          }
          field.distance_r[at(x, y)] = float(sum / weight);
        }
      }
    }
  }
  if (by.noise_r > 0) {
    for (float& d : field.distance_r) {
      if (d < field.eps_r) d = std::clamp(float(d + by.noise_r * normal()), 0.0f, field.eps_r);
    }
  }
  if (by.flying_pixel_band_px > 0) {
    const auto before = field.depth_m;
    std::vector<uint8_t> is_near(before.size(), 0);
    for (const Vec3& p : seen.samples) {
      const int x = int(std::lround(field.intrinsics.fx_px * p.x / p.z + field.intrinsics.cx_px));
      const int y = int(std::lround(field.intrinsics.fy_px * p.y / p.z + field.intrinsics.cy_px));
      for (int dy = -by.flying_pixel_band_px; dy <= by.flying_pixel_band_px; ++dy) {
        for (int dx = -by.flying_pixel_band_px; dx <= by.flying_pixel_band_px; ++dx) {
          if (dx * dx + dy * dy <= by.flying_pixel_band_px * by.flying_pixel_band_px) is_near[at(x + dx, y + dy)] = 1;
        }
      }
    }
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        if (!is_near[at(x, y)]) continue;
        double sum = 0, count = 0;
        for (int dy = -by.flying_pixel_band_px; dy <= by.flying_pixel_band_px; ++dy) {
          for (int dx = -by.flying_pixel_band_px; dx <= by.flying_pixel_band_px; ++dx) {
            const float z = before[at(x + dx, y + dy)];
            if (z > 0) sum += z, count += 1;
          }
        }
        if (count > 0) field.depth_m[at(x, y)] = float(sum / count);
      }
    }
  }
  if (by.depth_noise_r > 0) {
    for (float& z : field.depth_m) z = float(z * (1 + by.depth_noise_r / field.intrinsics.fx_px * normal()));
  }
}

struct CurveScore {
  double precision = 1, recall = 1, f_score = 1;
  double right_kind = 1;  // of what is found near a true curve
  double chamfer_r = 0, hausdorff_r = 0;
};

// By length, within `within_r` footprints.
inline CurveScore score(const SeenScene& seen, const EdgeCurves& found, double within_r = 2) {
  const double fx = seen.field.intrinsics.fx_px;
  std::vector<Vec3> points;
  std::vector<EdgeKind> kinds;
  for (const EdgeCurve& curve : found.curves) {
    for (int i = 0; i + 1 < curve.point_count; ++i) {
      const Vec3 a = found.points[size_t(curve.first_point + i)], b = found.points[size_t(curve.first_point + i) + 1];
      const int steps = std::max(1, int(length(b - a) / (0.5 * a.z / fx)));
      for (int k = 0; k < steps; ++k) {
        points.push_back(a + (k + 0.5) / steps * (b - a));
        kinds.push_back(curve.kind);
      }
    }
  }
  const auto nearest = [&](Vec3 p, const std::vector<Vec3>& set) {
    std::pair<double, size_t> best{INFINITY, 0};
    for (size_t i = 0; i < set.size(); ++i) {
      const Vec3 d = set[i] - p;
      best = std::min(best, {dot(d, d), i});
    }
    return std::pair<double, size_t>{std::sqrt(best.first) / (p.z / fx), best.second};
  };
  CurveScore result;
  double good = 0, kind_good = 0, covered = 0, sum = 0, other = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto [d, k] = nearest(points[i], seen.samples);
    sum += std::min(d, 100.0);
    result.hausdorff_r = std::max(result.hausdorff_r, std::min(d, 100.0));
    if (d > within_r) continue;
    good += 1;
    kind_good += seen.sample_kinds[k] == kinds[i];
  }
  for (const Vec3& p : seen.samples) {
    const double d = std::min(nearest(p, points).first, 100.0);
    other += d;
    result.hausdorff_r = std::max(result.hausdorff_r, d);
    covered += d <= within_r;
  }
  if (points.empty() && seen.samples.empty()) return result;
  result.precision = points.empty() ? 1 : good / double(points.size());
  result.recall = seen.samples.empty() ? 1 : covered / double(seen.samples.size());
  result.f_score = 2 * result.precision * result.recall / std::max(1e-12, result.precision + result.recall);
  result.right_kind = good > 0 ? kind_good / good : 1;
  result.chamfer_r = (points.empty() ? 100 : sum / double(points.size())) / 2 +
                     (seen.samples.empty() ? 100 : other / double(seen.samples.size())) / 2;
  return result;
}

}  // namespace maq::test
