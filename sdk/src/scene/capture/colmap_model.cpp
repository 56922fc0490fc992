#include "scene/capture/colmap_model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/error.h"

namespace maq {
namespace {

int size_of(uint64_t pixels) { return int(std::min<uint64_t>(pixels, INT32_MAX)); }

Lens lens_of(const ColmapCamera& camera) {
  const auto& p = camera.parameters;
  Lens lens;
  // Where the parameters before the distortion end: one focal length, or two.
  const bool has_one_focal_length = camera.model == ColmapModel::kSimplePinhole ||
                                    camera.model == ColmapModel::kSimpleRadial || camera.model == ColmapModel::kRadial;
  const size_t centre = has_one_focal_length ? 1 : 2, distortion = centre + 2;
  lens.intrinsics() = {size_of(camera.width_px), size_of(camera.height_px), p[0], p[centre - 1],
                       p[centre] - 0.5,          p[centre + 1] - 0.5};
  auto& k = lens.coefficients;
  switch (camera.model) {
    case ColmapModel::kSimplePinhole:
    case ColmapModel::kPinhole: return lens;
    case ColmapModel::kSimpleRadial: k[0] = p[distortion]; break;
    case ColmapModel::kRadial: std::copy_n(&p[distortion], 2, k.begin()); break;
    case ColmapModel::kOpenCvFisheye:
    case ColmapModel::kOpenCv: std::copy_n(&p[distortion], 4, k.begin()); break;
    case ColmapModel::kFullOpenCv: std::copy_n(&p[distortion], 8, k.begin()); break;
  }
  const bool is_fisheye = camera.model == ColmapModel::kOpenCvFisheye;
  const bool is_distorted = is_fisheye || std::any_of(k.begin(), k.end(), [](double value) { return value != 0; });
  if (is_distorted) lens.distortion = is_fisheye ? Distortion::kFisheye : Distortion::kRational;
  return lens;
}

// A quaternion that is of length 1 to within 1 % becomes a rotation; others give the zero matrix, which is not one.
std::array<double, 9> rotation_of(const std::array<double, 4>& quaternion) {
  const double length = std::sqrt(quaternion[0] * quaternion[0] + quaternion[1] * quaternion[1] +
                                  quaternion[2] * quaternion[2] + quaternion[3] * quaternion[3]);
  if (!std::isfinite(length)) return {length};
  if (!(std::abs(length - 1) <= 0.01)) return {};
  const double w = quaternion[0] / length, x = quaternion[1] / length, y = quaternion[2] / length,
               z = quaternion[3] / length;
  return {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
          2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
          2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
}

}  // namespace

std::vector<PosedPhoto> read_colmap_photos(const ColmapFiles& files, ImportReport& report) {
  std::map<uint32_t, Lens> lenses;
  for (const ColmapCamera& camera : files.cameras()) {
    if (!lenses.emplace(camera.id, lens_of(camera)).second) {
      report.add("cameras whose number was there before", std::to_string(camera.id));
    }
  }
  std::vector<PosedPhoto> photos;
  std::set<uint32_t> image_ids, used_cameras;
  for (ColmapImage& image : files.images()) {
    const auto lens = lenses.find(image.camera_id);
    if (lens == lenses.end()) {
      report.add("photos without a camera", image.name);
      continue;
    }
    used_cameras.insert(image.camera_id);
    if (!image_ids.insert(image.id).second) {
      report.add("photos whose number was there before", image.name);
      continue;
    }
    PosedPhoto photo;
    photo.name = std::move(image.name);
    photo.lens = lens->second;
    photo.rotation = rotation_of(image.rotation);
    const auto& t = image.translation;
    const auto& r = photo.rotation;
    for (size_t i = 0; i < 3; ++i) photo.centre[i] = -(r[i] * t[0] + r[3 + i] * t[1] + r[6 + i] * t[2]);
    photos.push_back(std::move(photo));
  }
  for (const auto& [id, lens] : lenses) {
    if (used_cameras.count(id) == 0) report.add("cameras without a photo", std::to_string(id));
  }
  return photos;
}

PointCloud read_colmap_points(const ColmapFiles& files, const std::array<double, 3>& origin, ImportReport& report) {
  PointCloud cloud;
  cloud.origin = origin;
  const auto check_count = [&](uint64_t count) {
    if (count > kMaxPoints) {
      throw Error(MAQ_ERROR_UNSUPPORTED, files.points_path(), " has over ", kMaxPoints, " points; thin it out.");
    }
  };
  size_t not_finite = 0;
  files.points(
      [&](uint64_t count) {
        check_count(count);
        cloud.reserve(size_t(count), true);
      },
      [&](const ColmapPoint& point) {
        check_count(cloud.count() + 1);
        if (!cloud.add(point.position[0], point.position[1], point.position[2])) {
          ++not_finite;
          return;
        }
        cloud.rgb.insert(cloud.rgb.end(), point.rgb.begin(), point.rgb.end());
      });
  report.add(kPointsNotFinite, "", not_finite);
  return cloud;
}

}  // namespace maq
