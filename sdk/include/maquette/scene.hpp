// Captures, dense clouds, scenes and their images, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_SCENE_HPP_
#define MAQUETTE_SCENE_HPP_

#include <string>
#include <utility>
#include <vector>

#include "maquette/capture.h"
#include "maquette/dense_cloud.h"
#include "maquette/frame.hpp"
#include "maquette/image.hpp"
#include "maquette/scene.h"

namespace maquette {

inline maq_scene_build_config default_scene_build_config() {
  maq_scene_build_config config;
  check(maq_scene_build_config_init(&config, sizeof config));
  return config;
}

inline maq_dense_cloud_config default_dense_cloud_config() {
  maq_dense_cloud_config config;
  check(maq_dense_cloud_config_init(&config, sizeof config));
  return config;
}

inline maq_scene_renderer_config default_scene_renderer_config() {
  maq_scene_renderer_config config;
  check(maq_scene_renderer_config_init(&config, sizeof config));
  return config;
}

class Capture {
 public:
  Capture(const Context& context, const std::string& folder) {
    maq_capture* opened = nullptr;
    check(maq_capture_open(context.get(), folder.c_str(), &opened));
    owner_.reset(opened);
  }

  maq_capture* get() const { return owner_.get(); }

  maq_capture_info info() const {
    maq_capture_info info{};
    info.struct_size = sizeof info;
    check(maq_capture_get_info(get(), &info));
    return info;
  }

  // The texts are the capture's.
  maq_capture_view view(uint32_t index) const {
    maq_capture_view view{};
    view.struct_size = sizeof view;
    check(maq_capture_get_view(get(), index, &view));
    return view;
  }

  // The text is the capture's.
  maq_capture_drop drop(uint32_t index) const {
    maq_capture_drop drop{};
    drop.struct_size = sizeof drop;
    check(maq_capture_get_drop(get(), index, &drop));
    return drop;
  }

  // Returns the depth image and its camera.
  std::pair<Frame, maq_pinhole_camera> load_depth(uint32_t index) const {
    maq_frame* frame = nullptr;
    maq_pinhole_camera camera{};
    camera.struct_size = sizeof camera;
    check(maq_capture_load_depth(get(), index, &camera, &frame));
    return {Frame(frame), camera};
  }

  // Returns the undistorted photo, MAQ_PIXEL_BGR8.
  Frame load_view(uint32_t index) const {
    maq_frame* frame = nullptr;
    check(maq_capture_load_view(get(), index, &frame));
    return Frame(frame);
  }

 private:
  Owner<maq_capture, maq_capture_destroy> owner_;
};

class Scene {
 public:
  // Takes over a scene of the C API.
  explicit Scene(maq_scene* scene) : owner_(scene) {}

  Scene(const Context& context, const std::string& path) {
    maq_scene* opened = nullptr;
    check(maq_scene_open(context.get(), path.c_str(), &opened));
    owner_.reset(opened);
  }

  // Opens a scene file in memory, which is copied.
  Scene(const Context& context, const void* data, size_t size_bytes) {
    maq_scene* opened = nullptr;
    check(maq_scene_open_memory(context.get(), data, size_bytes, &opened));
    owner_.reset(opened);
  }

  Scene(const Context& context, const maq_scene_build_config& config, const Capture& capture) {
    maq_scene* built = nullptr;
    check(maq_scene_build(context.get(), &config, capture.get(), &built));
    owner_.reset(built);
  }

  maq_scene* get() const { return owner_.get(); }

  void save(const std::string& path) const { check(maq_scene_save(get(), path.c_str())); }
  void save_ply(const std::string& path) const { check(maq_scene_save_ply(get(), path.c_str())); }

  maq_scene_info info() const {
    maq_scene_info info{};
    info.struct_size = sizeof info;
    check(maq_scene_get_info(get(), &info));
    return info;
  }

  // For scenes that were built, not opened.
  maq_scene_build_stats build_stats() const {
    maq_scene_build_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_scene_get_build_stats(get(), &stats));
    return stats;
  }

 private:
  Owner<maq_scene, maq_scene_destroy> owner_;
};

class DenseCloud {
 public:
  DenseCloud(const Context& context, const maq_dense_cloud_config& config, const std::vector<maq_posed_photo>& photos,
             const maq_point_cloud& sparse) {
    maq_dense_cloud* made = nullptr;
    check(maq_dense_cloud_create(context.get(), &config, photos.data(), uint32_t(photos.size()), &sparse, &made));
    owner_.reset(made);
  }

  maq_dense_cloud* get() const { return owner_.get(); }

  // The arrays are the cloud's. `rgb`, unless NULL, is set to the colours, 3 bytes a point.
  maq_point_cloud points(const uint8_t** rgb = nullptr) const {
    maq_point_cloud points{};
    points.struct_size = sizeof points;
    check(maq_dense_cloud_get_points(get(), &points, rgb));
    return points;
  }

  // Returns the depth image of a photo and its camera.
  std::pair<Frame, maq_pinhole_camera> load_depth(uint32_t index) const {
    maq_frame* frame = nullptr;
    maq_pinhole_camera camera{};
    camera.struct_size = sizeof camera;
    check(maq_dense_cloud_load_depth(get(), index, &camera, &frame));
    return {Frame(frame), camera};
  }

 private:
  Owner<maq_dense_cloud, maq_dense_cloud_destroy> owner_;
};

class SceneBuilder {
 public:
  SceneBuilder(const Context& context, const maq_scene_build_config& config, const maq_point_cloud& cloud) {
    maq_scene_builder* made = nullptr;
    check(maq_scene_builder_create(context.get(), &config, &cloud, &made));
    owner_.reset(made);
  }

  maq_scene_builder* get() const { return owner_.get(); }

  // Returns the number of points that the photo saw.
  uint64_t add_view(const Frame& photo, const maq_pinhole_camera& camera) {
    uint64_t seen_point_count = 0;
    check(maq_scene_builder_add_view(get(), photo.get(), &camera, &seen_point_count));
    return seen_point_count;
  }

  void cancel() { check(maq_scene_builder_cancel(get())); }

  maq_scene_build_stats stats() const {
    maq_scene_build_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_scene_builder_get_stats(get(), &stats));
    return stats;
  }

  Scene finish() {
    maq_scene* scene = nullptr;
    check(maq_scene_builder_finish(get(), &scene));
    return Scene(scene);
  }

 private:
  Owner<maq_scene_builder, maq_scene_builder_destroy> owner_;
};

class SceneRenderer {
 public:
  SceneRenderer(const Context& context, const maq_scene_renderer_config& config, const Scene& scene) {
    maq_scene_renderer* made = nullptr;
    check(maq_scene_renderer_create(context.get(), &config, scene.get(), &made));
    owner_.reset(made);
  }

  maq_scene_renderer* get() const { return owner_.get(); }

  Image run(const maq_pinhole_camera& camera) {
    maq_image* image = nullptr;
    check(maq_scene_renderer_run(get(), &camera, &image));
    return Image(image);
  }

 private:
  Owner<maq_scene_renderer, maq_scene_renderer_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_SCENE_HPP_
