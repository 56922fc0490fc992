// Heads from photos, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_HEAD_HPP_
#define MAQUETTE_HEAD_HPP_

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "maquette/frame.hpp"
#include "maquette/head.h"
#include "maquette/image.hpp"

namespace maquette {

inline maq_head_builder_config default_head_builder_config() {
  maq_head_builder_config config;
  check(maq_head_builder_config_init(&config, sizeof config));
  return config;
}

inline maq_head_photo default_head_photo() {
  maq_head_photo photo;
  check(maq_head_photo_init(&photo, sizeof photo));
  return photo;
}

inline maq_head_mesh_config default_head_mesh_config() {
  maq_head_mesh_config config;
  check(maq_head_mesh_config_init(&config, sizeof config));
  return config;
}

inline maq_head_renderer_config default_head_renderer_config() {
  maq_head_renderer_config config;
  check(maq_head_renderer_config_init(&config, sizeof config));
  return config;
}

class Head {
 public:
  // Takes over a head of the C API.
  explicit Head(maq_head* head) : owner_(head) {}

  static Head open(const Context& context, const std::string& path) {
    maq_head* opened = nullptr;
    check(maq_head_open(context.get(), path.c_str(), &opened));
    return Head(opened);
  }

  // Opens a head file in memory, which is copied.
  static Head open(const Context& context, const void* data, size_t size_bytes) {
    maq_head* opened = nullptr;
    check(maq_head_open_memory(context.get(), data, size_bytes, &opened));
    return Head(opened);
  }

  maq_head* get() const { return owner_.get(); }

  // Copies the head with the size at which the two landmarks are `distance_m` apart.
  Head scaled_by_distance(const std::string& from, const std::string& to, double distance_m) const {
    maq_head* scaled = nullptr;
    check(maq_head_scale_by_distance(get(), from.c_str(), to.c_str(), distance_m, &scaled));
    return Head(scaled);
  }

  // Copies the head with the size at which it fits the depth of the frame, in the view of the photo at `index`.
  Head scaled_by_depth(const Frame& frame, uint32_t index = 0) const {
    maq_head* scaled = nullptr;
    check(maq_head_scale_by_depth(get(), index, frame.get(), &scaled));
    return Head(scaled);
  }

  maq_head_info info() const {
    maq_head_info info{};
    info.struct_size = sizeof info;
    check(maq_head_get_info(get(), &info));
    return info;
  }

  std::vector<std::string> landmark_names() const {
    std::vector<std::string> names;
    for (uint32_t i = 0; i < info().landmark_count; ++i) names.emplace_back(maq_head_get_landmark_name(get(), i));
    return names;
  }

  maq_head_landmark landmark(const std::string& name) const {
    maq_head_landmark landmark{};
    landmark.struct_size = sizeof landmark;
    check(maq_head_get_landmark(get(), name.c_str(), &landmark));
    return landmark;
  }

  // Returns the camera of the photo at `index`, below info().photo_count.
  maq_pinhole_camera camera(uint32_t index) const {
    maq_pinhole_camera camera{};
    camera.struct_size = sizeof camera;
    check(maq_head_get_camera(get(), index, &camera));
    return camera;
  }

  void save(const std::string& path) const { check(maq_head_save(get(), path.c_str())); }

 private:
  Owner<maq_head, maq_head_destroy> owner_;
};

class HeadMesh {
 public:
  explicit HeadMesh(const Head& head, const maq_head_mesh_config& config = default_head_mesh_config()) {
    maq_head_mesh* made = nullptr;
    check(maq_head_mesh_create(head.get(), &config, &made));
    owner_.reset(made);
  }

  maq_head_mesh* get() const { return owner_.get(); }

  // The arrays are this object's.
  maq_head_mesh_data data() const {
    maq_head_mesh_data data{};
    data.struct_size = sizeof data;
    check(maq_head_mesh_get_data(get(), &data));
    return data;
  }

  // The arrays are this object's. `index` is below data().morph_target_count.
  maq_head_morph_target morph_target(uint32_t index) const {
    maq_head_morph_target target{};
    target.struct_size = sizeof target;
    check(maq_head_mesh_get_morph_target(get(), index, &target));
    return target;
  }

  void save(const std::string& path) const { check(maq_head_mesh_save(get(), path.c_str())); }

 private:
  Owner<maq_head_mesh, maq_head_mesh_destroy> owner_;
};

class HeadBuilder {
 public:
  HeadBuilder(const Context& context, const maq_head_builder_config& config) { create(context, config); }
  // Uses the bundle installed with the library.
  explicit HeadBuilder(const Context& context) { create(context, default_head_builder_config()); }
  HeadBuilder(const Context& context, const std::string& bundle_path) {
    maq_head_builder_config config = default_head_builder_config();
    config.model.bundle_path = bundle_path.c_str();
    create(context, config);
  }

  maq_head_builder* get() const { return owner_.get(); }

  void add_photo(const Frame& frame, const maq_head_photo& photo = default_head_photo()) {
    check(maq_head_builder_add_photo(get(), frame.get(), &photo));
  }
  // Uses `head` as prior for later fits.
  void add_head(const Head& head) { check(maq_head_builder_add_head(get(), head.get())); }
  void clear() { check(maq_head_builder_clear(get())); }

  Head fit(double seconds) {
    maq_head* fitted = nullptr;
    check(maq_head_builder_fit(get(), seconds, &fitted));
    return Head(fitted);
  }

  // `preview` gets the head so far during fits, which wait: first the network's head, then every `interval_s` seconds.
  // It must not throw. An empty function ends previews.
  void set_preview(double interval_s, std::function<void(Head)> preview) {
    auto kept = preview ? std::make_unique<std::function<void(Head)>>(std::move(preview)) : nullptr;
    const auto pass_on = [](void* user_data, maq_head* head) {
      (*static_cast<std::function<void(Head)>*>(user_data))(Head(head));
    };
    check(maq_head_builder_set_preview(get(), interval_s,
                                       kept ? static_cast<maq_head_preview_callback>(pass_on) : nullptr, kept.get()));
    preview_ = std::move(kept);
  }

  // From any thread: the running call, or else the next one, throws Error with MAQ_CANCELLED.
  void cancel() { check(maq_head_builder_cancel(get())); }

  maq_head_build_stats stats() const {
    maq_head_build_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_head_builder_get_stats(get(), &stats));
    return stats;
  }

  maq_head_photo_info photo(uint32_t index) const {
    maq_head_photo_info info{};
    info.struct_size = sizeof info;
    check(maq_head_builder_get_photo(get(), index, &info));
    return info;
  }

 private:
  void create(const Context& context, const maq_head_builder_config& config) {
    maq_head_builder* made = nullptr;
    check(maq_head_builder_create(context.get(), &config, &made));
    owner_.reset(made);
  }

  std::unique_ptr<std::function<void(Head)>> preview_;  // where the builder finds it, also when this is moved
  Owner<maq_head_builder, maq_head_builder_destroy> owner_;
};

class HeadRenderer {
 public:
  HeadRenderer(const Context& context, const maq_head_renderer_config& config, const HeadMesh& mesh) {
    maq_head_renderer* made = nullptr;
    check(maq_head_renderer_create(context.get(), &config, mesh.get(), &made));
    owner_.reset(made);
  }

  maq_head_renderer* get() const { return owner_.get(); }

  maq_pinhole_camera camera(double yaw_rad, double pitch_rad, int width_px, int height_px) const {
    maq_pinhole_camera camera{};
    camera.struct_size = sizeof camera;
    check(maq_head_renderer_get_camera(get(), yaw_rad, pitch_rad, width_px, height_px, &camera));
    return camera;
  }

  void set_shading(maq_head_shading shading) { check(maq_head_renderer_set_shading(get(), shading)); }

  Image run(const maq_pinhole_camera& camera) {
    maq_image* image = nullptr;
    check(maq_head_renderer_run(get(), &camera, &image));
    return Image(image);
  }

 private:
  Owner<maq_head_renderer, maq_head_renderer_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_HEAD_HPP_
