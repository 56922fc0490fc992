#include "head/render/head_renderer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/frame.h"
#include "head/mesh/file_axes.h"

namespace maq::head {
namespace {

constexpr float kMetresPerDecimetre = 0.1f;
constexpr double kOrbitHalfView_rad = 15 * 3.14159265358979323846 / 180, kOrbitMargin = 1.03;
constexpr size_t kPixelsOfTask = 16384;

// That no translation overflows, and no float of a depth.
constexpr double kFarthest_m = 1e30;

Vec3 vertex(const HeadMesh& mesh, size_t i) {
  return {double(mesh.positions[3 * i]), double(mesh.positions[3 * i + 1]), double(mesh.positions[3 * i + 2])};
}

HeadCamera camera_of(const PinholeCamera& from) {
  HeadCamera camera;
  std::copy(from.rotation.begin(), from.rotation.end(), camera.head_to_camera.rotation.begin());
  camera.head_to_camera.translation =
      -(camera.head_to_camera.rotation * Vec3{from.centre[0], from.centre[1], from.centre[2]});
  camera.focal_px = from.fx_px, camera.cx_px = from.cx_px, camera.cy_px = from.cy_px;
  camera.width_px = from.width_px, camera.height_px = from.height_px;
  return camera;
}

}  // namespace

HeadRenderer::HeadRenderer(HeadMesh mesh, std::optional<MeshTexture> texture, const HeadRenderOptions& options)
    : mesh_(std::move(mesh)), texture_(std::move(texture)), options_(options), threads_(options.threads) {
  if (mesh_.triangles.empty()) throw Error(MAQ_ERROR_UNSUPPORTED, "The head has no surface that could be drawn.");
  const auto scale = [](const float*) { return double(kMetresPerDecimetre); };
  mesh_.positions = to_file_axes(mesh_.positions, scale);
  mesh_.normals = normals_in_file(mesh_);
  mesh_.template_points = to_file_axes(mesh_.template_points, scale);
  Vec3 low = vertex(mesh_, 0), high = low;
  for (size_t i = 1; i < mesh_.vertex_count(); ++i) {
    const Vec3 p = vertex(mesh_, i);
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  middle_ = 0.5 * (low + high);
  for (size_t i = 0; i < mesh_.vertex_count(); ++i) radius_ = std::max(radius_, length(vertex(mesh_, i) - middle_));
}

void HeadRenderer::render(const PinholeCamera& camera, RenderedImage& image) {
  check_camera(camera, "The camera of a head's image");
  if (std::any_of(camera.centre.begin(), camera.centre.end(), [](double at) { return std::abs(at) > kFarthest_m; })) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The camera of a head's image is over ", kFarthest_m, " m away.");
  }
  const HeadCamera of = camera_of(camera);
  RasterOptions raster;
  raster.near = float(options_.near_m);
  raster.ambient = 1 - options_.shading_strength;
  raster.shading = options_.shading;
  if (texture_) raster.texture = &*texture_;
  raster.template_reach *= kMetresPerDecimetre;
  raster.middle_depth = float((of.head_to_camera * middle_).z), raster.depth_reach = float(radius_);
  raster.pixel_aspect = camera.fy_px / camera.fx_px;
  raster.is_smooth = options_.is_smooth;
  raster.draws_front_alone = true;
  raster_.draw(mesh_, of, raster, threads_, image);
  if (options_.background_rgb) lay_over_background(image);
}

void HeadRenderer::lay_over_background(RenderedImage& image) {
  const std::array<uint8_t, 3>& rgb = *options_.background_rgb;
  const size_t pixels = image.alpha.size();
  threads_.run((pixels + kPixelsOfTask - 1) / kPixelsOfTask, [&](size_t task, int) {
    for (size_t i = task * kPixelsOfTask; i < std::min(pixels, (task + 1) * kPixelsOfTask); ++i) {
      const int alpha = image.alpha[i];
      if (alpha == 255) continue;
      for (size_t channel = 0; channel < 3; ++channel) {
        uint8_t& value = image.bgr[3 * i + channel];
        value = uint8_t((value * alpha + rgb[2 - channel] * (255 - alpha) + 127) / 255);
      }
    }
  });
}

PinholeCamera HeadRenderer::orbit_camera(double yaw_rad, double pitch_rad, int width_px, int height_px) const {
  if (!std::isfinite(yaw_rad) || !std::isfinite(pitch_rad)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The yaw is ", yaw_rad, " and the pitch ", pitch_rad,
                ", but both must be finite, in radians.");
  }
  check_image_size(width_px, height_px, "The image of a head");
  PinholeCamera camera;
  camera.width_px = width_px, camera.height_px = height_px;
  camera.fx_px = camera.fy_px = 0.5 * std::min(width_px, height_px) / std::tan(kOrbitHalfView_rad);
  camera.cx_px = (width_px - 1) / 2.0, camera.cy_px = (height_px - 1) / 2.0;
  const double sin_yaw = std::sin(yaw_rad), cos_yaw = std::cos(yaw_rad);
  const double sin_pitch = std::sin(pitch_rad), cos_pitch = std::cos(pitch_rad);
  const Vec3 away{sin_yaw * cos_pitch, sin_pitch, cos_yaw * cos_pitch}, right{cos_yaw, 0, -sin_yaw};
  const Vec3 forward = -away, down = cross(forward, right);
  camera.rotation = {right.x, right.y, right.z, down.x, down.y, down.z, forward.x, forward.y, forward.z};
  const Vec3 centre = middle_ + (kOrbitMargin * radius_ / std::sin(kOrbitHalfView_rad)) * away;
  camera.centre = {centre.x, centre.y, centre.z};
  return camera;
}

}  // namespace maq::head
