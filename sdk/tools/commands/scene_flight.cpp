#include "commands/scene_flight.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace {

constexpr double kPi = 3.14159265358979323846;

cv::Matx33d rotation_of(const maq_pinhole_camera& camera) { return cv::Matx33d(camera.rotation); }

void set_rotation(maq_pinhole_camera& camera, const cv::Matx33d& rotation) {
  std::copy(rotation.val, rotation.val + 9, camera.rotation);
}

// The rotation nearest to a matrix.
cv::Matx33d nearest_rotation(const cv::Matx33d& matrix) {
  cv::Matx33d u, vt;
  cv::Matx31d w;
  cv::SVD::compute(matrix, w, u, vt);
  cv::Matx33d found = u * vt;
  if (cv::determinant(found) < 0) {
    for (int row = 0; row < 3; ++row) u(row, 2) = -u(row, 2);
    found = u * vt;
  }
  return found;
}

// Weights of four neighbours at 0 <= t <= 1 between the second and the third: a uniform cubic B-spline, which smooths
// the hand's shaking instead of passing through every stop.
cv::Vec4d spline(double t) {
  const double s = 1 - t;
  return cv::Vec4d(s * s * s, 3 * t * t * t - 6 * t * t + 4, 3 * s * s * s - 6 * s * s + 4, t * t * t) / 6.0;
}

}  // namespace

std::vector<maq_pinhole_camera> flight_through(const std::vector<maq_pinhole_camera>& stops, int frames) {
  const int last = int(stops.size()) - 1;
  std::vector<maq_pinhole_camera> cameras;
  for (int frame = 0; frame < frames; ++frame) {
    const double at = frames > 1 ? double(last) * frame / (frames - 1) : 0;
    const int before = std::min(int(at), std::max(0, last - 1));
    const cv::Vec4d weights = spline(at - before);
    maq_pinhole_camera camera = stops[size_t(before)];
    cv::Matx33d rotation = cv::Matx33d::zeros();
    cv::Vec3d centre(0, 0, 0);
    for (int k = 0; k < 4; ++k) {
      const maq_pinhole_camera& stop = stops[size_t(std::clamp(before + k - 1, 0, last))];
      rotation += weights[k] * rotation_of(stop);
      centre += weights[k] * cv::Vec3d(stop.centre);
    }
    set_rotation(camera, nearest_rotation(rotation));
    std::copy(centre.val, centre.val + 3, camera.centre);
    cameras.push_back(camera);
  }
  return cameras;
}

std::vector<maq_pinhole_camera> flight_around(const maq_scene_info& scene, int width_px, int height_px, int frames) {
  const cv::Vec3d low(scene.bounds_min), high(scene.bounds_max), middle = 0.5 * (low + high);
  const cv::Vec3d up = cv::normalize(cv::Vec3d(scene.up));
  const cv::Vec3d aside = std::abs(up[0]) < 0.9 ? cv::Vec3d(1, 0, 0) : cv::Vec3d(0, 1, 0);
  const cv::Vec3d first = cv::normalize(aside - up * aside.dot(up)), second = up.cross(first);
  const double half_angle = kPi / 6, focal_px = std::min(width_px, height_px) / (2 * std::tan(half_angle));
  const double radius = std::max(1e-9, 0.5 * cv::norm(high - low)) / std::sin(half_angle), elevation = kPi / 7;
  std::vector<maq_pinhole_camera> cameras;
  for (int frame = 0; frame < frames; ++frame) {
    const double angle = 2 * kPi * frame / frames;
    const cv::Vec3d away =
        std::cos(elevation) * (std::cos(angle) * first + std::sin(angle) * second) + std::sin(elevation) * up;
    const cv::Vec3d forward = -away, right = cv::normalize(forward.cross(up)), down = forward.cross(right);
    maq_pinhole_camera camera{};
    camera.struct_size = sizeof camera;
    camera.intrinsics.width_px = width_px;
    camera.intrinsics.height_px = height_px;
    camera.intrinsics.fx_px = camera.intrinsics.fy_px = focal_px;
    camera.intrinsics.cx_px = 0.5 * (width_px - 1);
    camera.intrinsics.cy_px = 0.5 * (height_px - 1);
    set_rotation(camera, cv::Matx33d(right[0], right[1], right[2], down[0], down[1], down[2], forward[0], forward[1],
                                     forward[2]));
    const cv::Vec3d centre = middle + radius * away;
    std::copy(centre.val, centre.val + 3, camera.centre);
    cameras.push_back(camera);
  }
  return cameras;
}

maq_pinhole_camera with_size(const maq_pinhole_camera& camera, int width_px, int height_px) {
  const double scale =
      std::min(double(width_px) / camera.intrinsics.width_px, double(height_px) / camera.intrinsics.height_px);
  maq_pinhole_camera sized = camera;
  sized.intrinsics.width_px = width_px;
  sized.intrinsics.height_px = height_px;
  sized.intrinsics.fx_px *= scale;
  sized.intrinsics.fy_px *= scale;
  // The middle stays the middle.
  sized.intrinsics.cx_px =
      (camera.intrinsics.cx_px - 0.5 * (camera.intrinsics.width_px - 1)) * scale + 0.5 * (width_px - 1);
  sized.intrinsics.cy_px =
      (camera.intrinsics.cy_px - 0.5 * (camera.intrinsics.height_px - 1)) * scale + 0.5 * (height_px - 1);
  return sized;
}
