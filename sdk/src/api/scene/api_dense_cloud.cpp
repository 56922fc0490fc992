#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/boundary.h"
#include "api/frame_handle.h"
#include "api/scene/scene_conversions.h"
#include "maquette/dense_cloud.h"
#include "scene/fusion/dense_cloud.h"

using namespace maq;

struct maq_dense_cloud : HandleOf<HandleKind::kDenseCloud> {
  DenseCloud made;
  std::vector<float> xyz;
  double up[3] = {0, 0, 0};
};

namespace {

maq_dense_cloud_config default_dense_cloud_config() {
  maq_dense_cloud_config config{};
  config.struct_size = sizeof config;
  return config;
}

void check_posed_photo(const maq_posed_photo& given, size_t index) {
  const std::string name = "photos[" + std::to_string(index) + "]";
  require_struct_size(name.c_str(), given.struct_size, sizeof(maq_posed_photo));
  require_argument(given.photo, (name + ".photo").c_str());
  if (given.mask != nullptr) require_argument(given.mask, (name + ".mask").c_str());
  check_camera(pinhole_of(given.camera), (name + ".camera").c_str());
  check_distortion(given.camera.intrinsics);
}

// The photo without distortion, no larger than depth is computed; not valid where the mask is black.
void load_posed_photo(const maq_posed_photo& given, PosedView& photo) {
  const Lens lens = lens_of(given.camera.intrinsics);
  const PinholeCamera pose = pinhole_of(given.camera);
  photo.load(given.photo->frame.image, lens, pose, kDepthLongSidePx);
  if (given.mask == nullptr) return;
  PosedView mask;
  mask.load(given.mask->frame.image, lens, pose, kDepthLongSidePx);
  photo.hide_black(mask.image());
}

void check_finite(const PointCloud& points) {
  for (size_t i = 0; i < points.count(); ++i) {
    if (!std::isfinite(points.x[i] + points.y[i] + points.z[i])) {
      throw ArgumentError("sparse.xyz[", i, "] is not finite.");
    }
  }
}

}  // namespace

maq_status maq_dense_cloud_config_init(maq_dense_cloud_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_dense_cloud_config());
}

maq_status maq_dense_cloud_create(maq_context* context, const maq_dense_cloud_config* given,
                                  const maq_posed_photo* photos, uint32_t photo_count, const maq_point_cloud* sparse,
                                  maq_dense_cloud** cloud) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(photos, "photos");
    require_argument(sparse, "sparse");
    require_argument(cloud, "cloud");
    const maq_dense_cloud_config config = read_config(given, "config", default_dense_cloud_config());
    require_range("config.threads", config.threads, 0, kMaxThreads);
    const PointCloud points = points_of_app("sparse", *sparse);
    check_finite(points);
    require_range("photo_count", photo_count, 1u, 100'000u);
    for (uint32_t i = 0; i < photo_count; ++i) check_posed_photo(photos[i], i);
    DenseCloudInput input;
    input.photos = photo_count;
    input.points = points.positions();
    input.load = [&](size_t index, PosedView& photo) {
      load_posed_photo(photos[index], photo);
      return true;
    };
    DenseCloudOptions options;
    options.threads = config.threads > 0 ? config.threads : default_threads();
    options.wants_colours = true;
    if (config.max_points != 0) options.max_points = config.max_points;
    std::optional<DenseCloud> dense =
        make_dense_cloud(input, options, progress_of(config.progress_callback, config.progress_user_data));
    if (!dense) return keep_error(context, MAQ_CANCELLED, nullptr, "The progress callback cancelled the cloud.");
    if (dense->cloud.count() == 0) {
      throw Error(
          MAQ_ERROR_NOT_FOUND,
          "No photo has depth: a photo needs 12 points of the sparse cloud in its image, and another photo that "
          "sees them from another place.");
    }
    auto made = std::make_unique<maq_dense_cloud>();
    made->xyz.reserve(3 * dense->cloud.count());
    for (size_t i = 0; i < dense->cloud.count(); ++i) {
      made->xyz.insert(made->xyz.end(), {dense->cloud.x[i], dense->cloud.y[i], dense->cloud.z[i]});
    }
    for (std::vector<float>* axis : {&dense->cloud.x, &dense->cloud.y, &dense->cloud.z}) *axis = {};
    made->made = std::move(*dense);
    std::copy_n(sparse->up, 3, made->up);
    *cloud = made.release();
    return MAQ_OK;
  });
}

void maq_dense_cloud_destroy(maq_dense_cloud* cloud) { destroy(cloud, "cloud", __func__); }

maq_status maq_dense_cloud_get_points(const maq_dense_cloud* cloud, maq_point_cloud* points, const uint8_t** rgb) {
  return guarded(cloud, __func__, [&] {
    require_argument(cloud, "cloud");
    maq_point_cloud filled{};
    filled.point_count = cloud->xyz.size() / 3;
    filled.xyz = cloud->xyz.data();
    std::copy_n(cloud->made.cloud.origin.begin(), 3, filled.origin);
    std::copy_n(cloud->up, 3, filled.up);
    write_struct(points, "points", filled);
    if (rgb != nullptr) *rgb = cloud->made.cloud.rgb.data();
    return MAQ_OK;
  });
}

maq_status maq_dense_cloud_load_depth(const maq_dense_cloud* cloud, uint32_t index, maq_pinhole_camera* camera,
                                      maq_frame** frame) {
  return guarded(cloud, __func__, [&] {
    require_argument(cloud, "cloud");
    require_argument(camera, "camera");
    require_argument(frame, "frame");
    require_index("index", index, cloud->made.maps.size());
    const DepthMap& map = cloud->made.maps[index];
    auto made = std::make_unique<maq_frame>();
    uint8_t* const pixels = made->frame.allocate(MAQ_PIXEL_DEPTH32F, map.camera.width_px, map.camera.height_px);
    std::copy_n(reinterpret_cast<const uint8_t*>(map.depth.data()), map.depth.size() * sizeof(float), pixels);
    made->frame.sequence = index;
    const maq_pinhole_camera pinhole = camera_of(map.camera);
    made->frame.intrinsics = pinhole.intrinsics;
    write_struct(camera, "camera", pinhole);
    *frame = made.release();
    return MAQ_OK;
  });
}
