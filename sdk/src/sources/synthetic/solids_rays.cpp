#include "sources/synthetic/solids_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maq {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kTiny = 1e-30;  // for 0, so that quotients are numbers

}  // namespace

void SolidsRays::look(const SolidsScene& scene, const SolidsView& view) {
  solids_.clear();
  solids_.reserve(scene.solids.size());
  for (const Solid& solid : scene.solids) {
    const auto turned = [&](const Vector3& v) {
      return Vector3{solid.cosine * v[0] + solid.sine * v[2], v[1], solid.cosine * v[2] - solid.sine * v[0]};
    };
    SeenSolid seen{solid.half, turned(view.centre - solid.centre), {}, solid.radius};
    for (size_t axis = 0; axis < 3; ++axis) seen.axes[axis] = turned(view.axes[axis]);
    solids_.push_back(seen);
  }
}

// Between pairs of planes, and the two ends of a cylinder's side, as intervals of the ray.
double SolidsRays::enter(const SeenSolid& solid, double x, double y) {
  double direction[3];
  double enters = 0, leaves = kInfinite;
  for (size_t axis = 0; axis < 3; ++axis) {
    double d = x * solid.axes[0][axis] + y * solid.axes[1][axis] + solid.axes[2][axis];
    if (d == 0) d = kTiny;
    direction[axis] = d;
    const double side = d > 0 ? solid.half[axis] : -solid.half[axis];
    enters = std::max(enters, (-side - solid.origin[axis]) / d);
    leaves = std::min(leaves, (side - solid.origin[axis]) / d);
  }
  if (solid.radius > 0) {
    const double a = std::max(direction[0] * direction[0] + direction[2] * direction[2], kTiny);
    const double b = solid.origin[0] * direction[0] + solid.origin[2] * direction[2];
    const double c =
        solid.origin[0] * solid.origin[0] + solid.origin[2] * solid.origin[2] - solid.radius * solid.radius;
    const double root = b * b - a * c;
    if (root < 0) return kInfinite;
    enters = std::max(enters, (-b - std::sqrt(root)) / a);
    leaves = std::min(leaves, (-b + std::sqrt(root)) / a);
  }
  return enters > 0 && enters < leaves ? enters : kInfinite;
}

double SolidsRays::depth(double x, double y) const {
  double nearest = kInfinite;
  for (const SeenSolid& solid : solids_) nearest = std::min(nearest, enter(solid, x, y));
  return nearest;
}

SolidsRays::Window SolidsRays::window_of(const SeenSolid& solid, const SolidsPicture& picture) {
  constexpr double kNear = 0.01;
  double left = kInfinite, top = kInfinite, right = -kInfinite, bottom = -kInfinite;
  for (int corner = 0; corner < 8; ++corner) {
    Vector3 from_camera;
    for (size_t axis = 0; axis < 3; ++axis) {
      from_camera[axis] = ((corner >> axis & 1) != 0 ? solid.half[axis] : -solid.half[axis]) - solid.origin[axis];
    }
    const double z = dot(solid.axes[2], from_camera);
    if (z < kNear) return {0, 0, picture.width_px, picture.height_px};  // partly behind the camera
    const double x = picture.focal_px() * dot(solid.axes[0], from_camera) / z + picture.centre_x_px();
    const double y = picture.focal_px() * dot(solid.axes[1], from_camera) / z + picture.centre_y_px();
    left = std::min(left, x);
    right = std::max(right, x);
    top = std::min(top, y);
    bottom = std::max(bottom, y);
  }
  const auto inside = [](double value, int limit) { return int(std::clamp(value, 0.0, double(limit))); };
  return {inside(std::floor(left), picture.width_px), inside(std::floor(top), picture.height_px),
          inside(std::ceil(right) + 1, picture.width_px), inside(std::ceil(bottom) + 1, picture.height_px)};
}

void SolidsRays::draw(const SolidsPicture& picture, float* metres) const {
  constexpr float kNothing = std::numeric_limits<float>::infinity();
  const size_t width = size_t(picture.width_px), pixels = width * size_t(picture.height_px);
  std::fill_n(metres, pixels, kNothing);
  for (const SeenSolid& solid : solids_) {
    const Window window = window_of(solid, picture);
    for (int row = window.top; row < window.bottom; ++row) {
      const double y = (row - picture.centre_y_px()) / picture.focal_px();
      float* const depths = metres + size_t(row) * width;
      for (int column = window.left; column < window.right; ++column) {
        const double x = (column - picture.centre_x_px()) / picture.focal_px();
        depths[column] = std::min(depths[column], float(enter(solid, x, y)));
      }
    }
  }
  std::replace(metres, metres + pixels, kNothing, 0.0f);
}

}  // namespace maq
