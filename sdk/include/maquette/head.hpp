// Heads from photos, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_HEAD_HPP_
#define MAQUETTE_HEAD_HPP_

#include <exception>
#include <functional>
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

  maq_head* get() const { return owner_.get(); }

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

  // Its arrays are this object's, until a mesh with other options is asked for.
  maq_head_mesh mesh(const maq_head_mesh_options& options = default_head_mesh_options()) {
    maq_head_mesh mesh{};
    mesh.struct_size = sizeof mesh;
    check(maq_head_get_mesh(get(), &options, &mesh));
    return mesh;
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

  Owner<maq_head_builder, maq_head_builder_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_HEAD_HPP_
