// Heads from photos, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_HEAD_HPP_
#define MAQUETTE_HEAD_HPP_

#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "maquette/frame.hpp"
#include "maquette/head.h"

namespace maquette {

inline maq_head_config default_head_config() {
  maq_head_config config;
  check(maq_head_config_init(&config, sizeof config));
  return config;
}

inline maq_head_photo default_head_photo() {
  maq_head_photo photo;
  check(maq_head_photo_init(&photo, sizeof photo));
  return photo;
}

inline maq_head_mesh_options default_head_mesh_options() {
  maq_head_mesh_options options;
  check(maq_head_mesh_options_init(&options, sizeof options));
  return options;
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

  // A head file in memory, which is copied.
  static Head open(const Context& context, const void* data, size_t size_bytes) {
    maq_head* opened = nullptr;
    check(maq_head_open_memory(context.get(), data, size_bytes, &opened));
    return Head(opened);
  }

  maq_head* get() const { return owner_.get(); }

  // The same head of the size at which the two places are so far apart.
  Head scaled_by_distance(const std::string& from, const std::string& to, double distance_m) {
    maq_head* scaled = nullptr;
    check(maq_head_scale_by_distance(get(), from.c_str(), to.c_str(), distance_m, &scaled));
    return Head(scaled);
  }

  // The same head of the size at which it lies where the depth of the frame sees it, from the photo at `index`.
  Head scaled_by_depth(const Frame& frame, uint32_t index = 0) {
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

  // Of the photo at `index`, below info().photo_count.
  maq_pinhole_camera camera(uint32_t index) const {
    maq_pinhole_camera camera{};
    camera.struct_size = sizeof camera;
    check(maq_head_get_camera(get(), index, &camera));
    return camera;
  }

  // Its arrays are this object's, until a mesh with other options is asked for.
  maq_head_mesh mesh(const maq_head_mesh_options& options = default_head_mesh_options()) {
    maq_head_mesh mesh{};
    mesh.struct_size = sizeof mesh;
    check(maq_head_get_mesh(get(), &options, &mesh));
    return mesh;
  }

  // Of the mesh that was made last.
  maq_head_morph_target morph_target(uint32_t index) const {
    maq_head_morph_target target{};
    target.struct_size = sizeof target;
    check(maq_head_get_morph_target(get(), index, &target));
    return target;
  }

  void save(const std::string& path) const { check(maq_head_save(get(), path.c_str())); }
  void export_mesh(const std::string& path, const maq_head_mesh_options& options = default_head_mesh_options()) {
    check(maq_head_export(get(), path.c_str(), &options));
  }

 private:
  Owner<maq_head, maq_head_destroy> owner_;
};

class HeadBuilder {
 public:
  HeadBuilder(const Context& context, const maq_head_config& config) { create(context, config); }
  // The bundle installed with the library.
  explicit HeadBuilder(const Context& context) { create(context, default_head_config()); }
  HeadBuilder(const Context& context, const std::string& bundle_path) {
    maq_head_config config = default_head_config();
    config.bundle_path = bundle_path.c_str();
    create(context, config);
  }

  maq_head_builder* get() const { return owner_.get(); }

  void add_photo(const Frame& frame, const maq_head_photo& photo = default_head_photo()) {
    check(maq_head_builder_add_photo(get(), frame.get(), &photo));
  }
  // Adds the photos to those that `head` was fitted to.
  void add_head(const Head& head) { check(maq_head_builder_add_head(get(), head.get())); }
  void clear() { check(maq_head_builder_clear(get())); }

  // `progress` gets the fraction that is done and returns whether to go on; what it throws ends the fit and is thrown.
  Head fit(double seconds, const std::function<bool(double)>& progress = {}) {
    struct Call {
      const std::function<bool(double)>& progress;
      std::exception_ptr failure;
    } call{progress, {}};
    const auto pass_on = [](void* user_data, double done) -> int32_t {
      auto* const to = static_cast<Call*>(user_data);
      try {
        return to->progress(done) ? 1 : 0;
      } catch (...) {
        to->failure = std::current_exception();
        return 0;
      }
    };
    maq_head* fitted = nullptr;
    const maq_status status = maq_head_builder_fit(
        get(), seconds, progress ? static_cast<maq_head_progress_callback>(pass_on) : nullptr, &call, &fitted);
    if (call.failure) {
      maq_head_destroy(fitted);
      std::rethrow_exception(call.failure);
    }
    check(status);
    return Head(fitted);
  }

  // `preview` gets the head so far during fits, which wait: first what the network saw, then every `interval_s`
  // seconds. It may not throw. An empty one: no longer.
  void set_preview(double interval_s, std::function<void(Head)> preview) {
    auto kept = preview ? std::make_unique<std::function<void(Head)>>(std::move(preview)) : nullptr;
    const auto pass_on = [](void* user_data, maq_head* head) {
      (*static_cast<std::function<void(Head)>*>(user_data))(Head(head));
    };
    check(maq_head_builder_set_preview(get(), interval_s,
                                       kept ? static_cast<maq_head_preview_callback>(pass_on) : nullptr, kept.get()));
    preview_ = std::move(kept);
  }

  // From any thread: what runs, or else the next, throws Error with MAQ_CANCELLED.
  void cancel() { check(maq_head_builder_cancel(get())); }

  maq_head_stats stats() const {
    maq_head_stats stats{};
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
  void create(const Context& context, const maq_head_config& config) {
    maq_head_builder* made = nullptr;
    check(maq_head_builder_create(context.get(), &config, &made));
    owner_.reset(made);
  }

  std::unique_ptr<std::function<void(Head)>> preview_;  // where the builder finds it, also when this is moved
  Owner<maq_head_builder, maq_head_builder_destroy> owner_;
};

inline maq_head_renderer_config default_head_renderer_config() {
  maq_head_renderer_config config;
  check(maq_head_renderer_config_init(&config, sizeof config));
  return config;
}

class HeadImage {
 public:
  // Takes over an image of the C API.
  explicit HeadImage(maq_head_image* image) : owner_(image) {}

  maq_head_image* get() const { return owner_.get(); }

  // Rows of *stride_bytes.
  const void* plane(maq_head_plane plane, size_t* stride_bytes) const {
    const void* pixels = nullptr;
    check(maq_head_image_get_plane(get(), plane, &pixels, stride_bytes));
    return pixels;
  }

  void save(const std::string& path, bool with_alpha = false) const {
    check(maq_head_image_save(get(), path.c_str(), with_alpha ? 1 : 0));
  }

 private:
  Owner<maq_head_image, maq_head_image_release> owner_;
};

class HeadRenderer {
 public:
  HeadRenderer(const Context& context, const maq_head_renderer_config& config, Head& head) {
    maq_head_renderer* made = nullptr;
    check(maq_head_renderer_create(context.get(), &config, head.get(), &made));
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

  HeadImage run(const maq_pinhole_camera& camera) {
    maq_head_image* image = nullptr;
    check(maq_head_renderer_run(get(), &camera, &image));
    return HeadImage(image);
  }

 private:
  Owner<maq_head_renderer, maq_head_renderer_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_HEAD_HPP_
