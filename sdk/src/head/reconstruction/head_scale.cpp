#include "head/reconstruction/head_scale.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "head/mesh/mesh_raster.h"
#include "head/reconstruction/head_surface.h"
#include "image/depth.h"

namespace maq::head {
namespace {

constexpr double kMinLandmarkDistance = 0.01;  // units
constexpr double kMaxAspectError = 0.01;
constexpr double kCell_m = 0.004;    // of the mesh that depth is compared with: within 0.3 mm of the surface
constexpr float kFacing = -0.5f;     // normals beyond: within 60 degrees of the camera
constexpr double kAgreement = 0.15;  // of the median: pixels farther off are hair, a hand, the background
constexpr size_t kMinPixels = 30;
constexpr double kSigmaOfMad = 1.4826;  // of a normal distribution

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The photo's camera for an image of another size.
HeadCamera camera_of_size(HeadCamera camera, int width_px, int height_px) {
  const double across = double(width_px) / camera.width_px, down = double(height_px) / camera.height_px;
  if (std::abs(across / down - 1) > kMaxAspectError) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The depth image has ", width_px, " x ", height_px,
                " pixels, but the photo has ", camera.width_px, " x ", camera.height_px,
                ", of another shape; give depth of the same view.");
  }
  camera.focal_px *= across;
  camera.cx_px = (camera.cx_px + 0.5) * across - 0.5;
  camera.cy_px = (camera.cy_px + 0.5) * down - 0.5;
  camera.width_px = width_px;
  camera.height_px = height_px;
  return camera;
}

}  // namespace

HeadScale scale_by_distance(const StoredHead& head, const std::string& from, const std::string& to, double distance_m) {
  if (!(distance_m >= kMinKnownDistance_m && distance_m <= kMaxKnownDistance_m)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The distance between \"", from, "\" and \"", to, "\" is ", distance_m,
                " m, but must be ", kMinKnownDistance_m, " to ", kMaxKnownDistance_m, ".");
  }
  const HeadLandmark first = find_head_landmark(head, from), second = find_head_landmark(head, to);
  const double distance = length(second.point - first.point);
  if (!(distance >= kMinLandmarkDistance)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "\"", from, "\" and \"", to,
                "\" are the same landmark; name two landmarks that lie apart, such as pupil_left and pupil_right.");
  }
  const double metres = distance_m / distance;
  return {metres, metres * std::hypot(first.sigma, second.sigma) / distance, ScaleSource::kGiven};
}

HeadScale scale_by_depth(const StoredHead& head, size_t camera, const ImageView& depth, WorkerThreads& threads) {
  if (!is_depth(depth.format)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The image is a picture (", pixel_format_name(depth.format),
                "), not depth (DEPTH16, DEPTH32F).");
  }
  const HeadCamera seen_by = camera_of_size(head.cameras.at(camera), depth.width_px, depth.height_px);
  StoredHead in_units = head;
  in_units.scale.metres_per_unit = 0.1;  // so that the mesh is in the head's own unit
  const HeadMesh mesh = head_surface(in_units, {kCell_m}, threads);
  RenderedImage drawn;
  MeshRaster().draw(mesh, seen_by, {}, threads, drawn);
  std::vector<float> depth_m(drawn.depth.size());
  depth_in_metres(depth, depth_m.data());

  size_t facing = 0;
  std::vector<double> metres;  // a unit, by each pixel
  for (size_t i = 0; i < drawn.depth.size(); ++i) {
    if (drawn.depth[i] <= 0 || drawn.normals[3 * i + 2] > kFacing) continue;
    ++facing;
    if (depth_m[i] > 0) metres.push_back(double(depth_m[i]) / double(drawn.depth[i]));
  }
  if (metres.size() < kMinPixels || 2 * metres.size() < facing) {
    throw Error(MAQ_ERROR_NOT_FOUND, "Of ", facing, " pixels that show the head, ", metres.size(),
                " have depth; it takes half of them, and ", kMinPixels, ". Take the depth of the same photo, nearer.");
  }
  const double middle = median_of(metres);
  std::vector<double> deviations;
  for (const double value : metres) {
    const double deviation = std::abs(value / middle - 1);
    if (deviation <= kAgreement) deviations.push_back(deviation);
  }
  if (2 * deviations.size() < metres.size()) {
    throw Error(MAQ_ERROR_NOT_FOUND, "Of ", metres.size(), " pixels of depth ", deviations.size(),
                " agree with the head; it takes half of them. Take the depth of the same photo.");
  }
  return {middle, middle * kSigmaOfMad * median_of(deviations), ScaleSource::kDepth};
}

}  // namespace maq::head
