#include "body/sizes/body_sizes.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "body/pose/body_bones.h"
#include "core/error.h"

namespace maq::body {
namespace {

constexpr std::array<double, 3> kLevels = {0.65, 0.35, -0.05};  // chest, waist, hip
constexpr double kMiddle_m = 0.012;                             // |x| of vertices that may be the crotch
constexpr double kMaxArm = 0.5;                                 // weight of arms in a vertex of the torso
constexpr const char* kArmJoints[] = {"upper_arm.L", "lower_arm.L", "hand.L", "upper_arm.R", "lower_arm.R", "hand.R"};

struct PlanePoint {
  double x, y;
};

size_t needed_joint(const BodyModel& model, const std::string& name) {
  const int index = model.find_joint(name);
  if (index < 0) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, "The body has no joint ", name,
                ", which its sizes need. Export the bundle again.");
  }
  return size_t(index);
}

// The z of a point, from the first joint.
template <class Point>
ShapeLength height_at(const Point& point) {
  ShapeLength made;
  made.rest_m = point.rest.z;
  for (size_t s = 0; s < kMaxShapes; ++s) made.by_shape_m[s] = point.basis[s].z;
  return made;
}

// (1 - fraction) a + fraction b
ShapeLength between(const ShapeLength& a, const ShapeLength& b, double fraction) {
  ShapeLength made;
  made.rest_m = a.rest_m + fraction * (b.rest_m - a.rest_m);
  for (size_t s = 0; s < kMaxShapes; ++s) {
    made.by_shape_m[s] = a.by_shape_m[s] + fraction * (b.by_shape_m[s] - a.by_shape_m[s]);
  }
  return made;
}

ShapeLength difference(const ShapeLength& a, const ShapeLength& b) {
  ShapeLength made;
  made.rest_m = a.rest_m - b.rest_m;
  for (size_t s = 0; s < kMaxShapes; ++s) made.by_shape_m[s] = a.by_shape_m[s] - b.by_shape_m[s];
  return made;
}

const BodyPoint& lowest_vertex(const BodyModel& model) {
  const auto is_lower = [](const BodyPoint& a, const BodyPoint& b) { return a.rest.z < b.rest.z; };
  return *std::min_element(model.vertices.begin(), model.vertices.end(), is_lower);
}

double weight_of(const BodyPoint& point, const std::vector<size_t>& joints) {
  double sum = 0;
  for (size_t k = 0; k < kWeights; ++k) {
    if (std::find(joints.begin(), joints.end(), size_t(point.joints[k])) != joints.end()) sum += point.weights[k];
  }
  return sum;
}

// The lowest vertex of the pelvis in the plane between the legs.
const BodyPoint& crotch_of(const BodyModel& model) {
  const BodyPoint* found = nullptr;
  for (const BodyPoint& vertex : model.vertices) {
    if (std::abs(vertex.rest.x) > kMiddle_m || weight_of(vertex, {0}) < 0.5) continue;
    if (found == nullptr || vertex.rest.z < found->rest.z) found = &vertex;
  }
  if (found == nullptr) throw Error(MAQ_ERROR_BAD_BUNDLE, "The body has no vertex at its crotch. Export it again.");
  return *found;
}

// The perimeter of the convex hull of points (Andrew, "Another efficient algorithm for convex hulls in two dimensions",
// 1979). Reorders the points.
double hull_perimeter(std::vector<PlanePoint>& points) {
  if (points.size() < 3) return 0;
  std::sort(points.begin(), points.end(),
            [](const PlanePoint& a, const PlanePoint& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  const auto turns_left = [](const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > 0;
  };
  std::vector<PlanePoint> hull;
  hull.reserve(points.size() + 1);
  const auto add_chain = [&](auto begin, auto end) {
    const size_t base = hull.size();
    for (auto at = begin; at != end; ++at) {
      while (hull.size() >= base + 2 && !turns_left(hull[hull.size() - 2], hull.back(), *at)) hull.pop_back();
      hull.push_back(*at);
    }
  };
  add_chain(points.begin(), points.end());
  hull.pop_back();  // the first of the other chain
  add_chain(points.rbegin(), points.rend());
  double length = 0;
  for (size_t i = 1; i < hull.size(); ++i) length += std::hypot(hull[i].x - hull[i - 1].x, hull[i].y - hull[i - 1].y);
  return length;
}

}  // namespace

double ShapeLength::of(const ShapeNumbers& shape) const {
  double length = rest_m;
  for (size_t s = 0; s < kMaxShapes; ++s) length += shape[s] * by_shape_m[s];
  return length;
}

ShapeLength height_of(const BodyModel& model) {
  const auto is_lower = [](const BodyPoint& a, const BodyPoint& b) { return a.rest.z < b.rest.z; };
  const BodyPoint& top = *std::max_element(model.vertices.begin(), model.vertices.end(), is_lower);
  return difference(height_at(top), height_at(lowest_vertex(model)));
}

BodySizes::BodySizes(const BodyModel& model)
    : shape_count_(model.shape_count),
      height_(height_of(model)),
      inseam_(difference(height_at(crotch_of(model)), height_at(lowest_vertex(model)))) {
  const ShapeLength hips = between(height_at(model.joints[needed_joint(model, "upper_leg.L")]),
                                   height_at(model.joints[needed_joint(model, "upper_leg.R")]), 0.5);
  const ShapeLength neck = height_at(model.joints[needed_joint(model, "neck")]);
  for (size_t k = 0; k < kLevels.size(); ++k) level_[k] = between(hips, neck, kLevels[k]);
  std::vector<size_t> arms;
  for (const char* name : kArmJoints) arms.push_back(needed_joint(model, name));
  constexpr uint32_t kUnused = UINT32_MAX;
  std::vector<uint32_t> own(model.vertices.size(), kUnused);
  for (size_t i = 0; i < model.triangles.size(); i += 3) {
    const uint32_t* const corners = model.triangles.data() + i;
    const auto is_torso = [&](uint32_t vertex) { return weight_of(model.vertices[vertex], arms) < kMaxArm; };
    if (!std::all_of(corners, corners + 3, is_torso)) continue;
    for (size_t k = 0; k < 3; ++k) {
      uint32_t& number = own[corners[k]];
      if (number == kUnused) {
        number = uint32_t(torso_.size());
        torso_.push_back({model.vertices[corners[k]].rest, model.vertices[corners[k]].basis});
      }
      triangles_.push_back(number);
    }
  }
}

Sizes BodySizes::sizes_m(const ShapeNumbers& shape) const {
  std::vector<Vec3> placed;
  placed.reserve(torso_.size());
  for (const Vertex& vertex : torso_) placed.push_back(shaped(vertex.rest, vertex.basis, shape, shape_count_));
  std::vector<PlanePoint> section;
  const auto girth = [&](size_t level) {
    const double z = level_[level].of(shape);
    section.clear();
    for (size_t i = 0; i < triangles_.size(); ++i) {
      const Vec3 a = placed[triangles_[i]], b = placed[triangles_[i % 3 == 2 ? i - 2 : i + 1]];
      if ((a.z < z) == (b.z < z)) continue;
      const double t = (z - a.z) / (b.z - a.z);
      section.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
    }
    return hull_perimeter(section);
  };
  return {height_.of(shape), girth(0), girth(1), girth(2), inseam_.of(shape)};
}

}  // namespace maq::body
