#include "commands/scene_flight.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace {

constexpr double kPi = 3.14159265358979323846;

using Vector = std::array<double, 3>;
using Matrix = std::array<double, 9>;  // row by row

Vector vector_of(const double* values) { return {values[0], values[1], values[2]}; }
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector sum(double a, const Vector& x, double b, const Vector& y) {
  return {a * x[0] + b * y[0], a * x[1] + b * y[1], a * x[2] + b * y[2]};
}
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector normalized(const Vector& a) { return sum(1 / std::sqrt(dot(a, a)), a, 0, a); }

// The rotation nearest to the mean of rotations: the orthogonal factor of its polar decomposition, by Newton's
// iteration (Higham 1986). Without a mean, as of opposite rotations, the matrix as it is.
Matrix nearest_rotation(Matrix matrix) {
  for (int iteration = 0; iteration < 30; ++iteration) {
    const Vector rows[] = {vector_of(&matrix[0]), vector_of(&matrix[3]), vector_of(&matrix[6])};
    // The inverse, transposed, has the cross products of the rows in its rows.
    const double determinant = dot(rows[0], cross(rows[1], rows[2]));
    if (!(determinant > 1e-9)) return matrix;
    for (size_t row = 0; row < 3; ++row) {
      const Vector inverse = cross(rows[(row + 1) % 3], rows[(row + 2) % 3]);
      const Vector mean = sum(0.5, rows[row], 0.5 / determinant, inverse);
      std::copy(mean.begin(), mean.end(), matrix.begin() + ptrdiff_t(3 * row));
    }
  }
  return matrix;
}

// Weights of four neighbours at 0 <= t <= 1 between the second and the third: a uniform cubic B-spline, which smooths
// the hand's shaking instead of passing through every stop.
std::array<double, 4> spline(double t) {
  const double s = 1 - t;
  return {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6};
}

}  // namespace

std::vector<maq_pinhole_camera> flight_through(const std::vector<maq_pinhole_camera>& stops, int frames) {
  const int last = int(stops.size()) - 1;
  std::vector<maq_pinhole_camera> cameras;
  for (int frame = 0; frame < frames; ++frame) {
    const double at = frames > 1 ? double(last) * frame / (frames - 1) : 0;
    const int before = std::min(int(at), std::max(0, last - 1));
    const std::array<double, 4> weights = spline(at - before);
    maq_pinhole_camera camera = stops[size_t(before)];
    Matrix rotation{};
    Vector centre{};
    for (int k = 0; k < 4; ++k) {
      const maq_pinhole_camera& stop = stops[size_t(std::clamp(before + k - 1, 0, last))];
      for (size_t i = 0; i < 9; ++i) rotation[i] += weights[size_t(k)] * stop.rotation[i];
      centre = sum(1, centre, weights[size_t(k)], vector_of(stop.centre));
    }
    rotation = nearest_rotation(rotation);
    std::copy(rotation.begin(), rotation.end(), camera.rotation);
    std::copy(centre.begin(), centre.end(), camera.centre);
    cameras.push_back(camera);
  }
  return cameras;
}

std::vector<maq_pinhole_camera> flight_around(const maq_scene_info& scene, int width_px, int height_px, int frames) {
  const Vector low = vector_of(scene.bounds_min), high = vector_of(scene.bounds_max), middle = sum(0.5, low, 0.5, high);
  const Vector up = normalized(vector_of(scene.up)), across = sum(1, high, -1, low);
  const Vector aside = std::abs(up[0]) < 0.9 ? Vector{1, 0, 0} : Vector{0, 1, 0};
  const Vector first = normalized(sum(1, aside, -dot(aside, up), up)), second = cross(up, first);
  const double half_angle = kPi / 6, focal_px = std::min(width_px, height_px) / (2 * std::tan(half_angle));
  const double radius = std::max(1e-9, 0.5 * std::sqrt(dot(across, across))) / std::sin(half_angle);
  const double elevation = kPi / 7;
  std::vector<maq_pinhole_camera> cameras;
  for (int frame = 0; frame < frames; ++frame) {
    const double angle = 2 * kPi * frame / frames;
    const Vector level = sum(std::cos(angle), first, std::sin(angle), second);
    const Vector away = sum(std::cos(elevation), level, std::sin(elevation), up);
    const Vector forward = sum(-1, away, 0, away), right = normalized(cross(forward, up)), down = cross(forward, right);
    maq_pinhole_camera camera{};
    camera.struct_size = sizeof camera;
    camera.intrinsics.width_px = width_px;
    camera.intrinsics.height_px = height_px;
    camera.intrinsics.fx_px = camera.intrinsics.fy_px = focal_px;
    camera.intrinsics.cx_px = 0.5 * (width_px - 1);
    camera.intrinsics.cy_px = 0.5 * (height_px - 1);
    double* to = camera.rotation;
    for (const Vector& row : {right, down, forward}) to = std::copy(row.begin(), row.end(), to);
    const Vector centre = sum(1, middle, radius, away);
    std::copy(centre.begin(), centre.end(), camera.centre);
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
