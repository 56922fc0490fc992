// Edges of depth frames: fields, curves, boxes and fusion of views, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_EDGES_HPP_
#define MAQUETTE_EDGES_HPP_

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "maquette/edge_curves.h"
#include "maquette/edges.h"
#include "maquette/edges_fusion.h"
#include "maquette/frame.hpp"

namespace maquette {

inline maq_edges_config default_edges_config() {
  maq_edges_config config;
  check(maq_edges_config_init(&config, sizeof config));
  return config;
}

inline maq_edges_curves_config default_edges_curves_config() {
  maq_edges_curves_config config;
  check(maq_edges_curves_config_init(&config, sizeof config));
  return config;
}

inline maq_edges_fusion_config default_edges_fusion_config() {
  maq_edges_fusion_config config;
  check(maq_edges_fusion_config_init(&config, sizeof config));
  return config;
}

// The curves of a result. They may outlive it.
class EdgesCurves {
 public:
  // Takes ownership of curves from the C API.
  explicit EdgesCurves(maq_edges_curves* curves) : owner_(curves) {}
  // Refers to the curves in a pipeline's result.
  explicit EdgesCurves(PartOf<maq_edges_curves> part)
      : owner_(const_cast<maq_edges_curves*>(part.handle), {std::move(part.whole)}) {}

  maq_edges_curves* get() const { return owner_.get(); }

  // The pointers are valid as long as this object.
  std::vector<maq_edges_curve> curves() const {
    return items(maq_edges_curves_get_curve_count, maq_edges_curves_get_curve);
  }
  std::vector<maq_edges_corner> corners() const {
    return items(maq_edges_curves_get_corner_count, maq_edges_curves_get_corner);
  }
  // Sorted by volume, the largest first.
  std::vector<maq_edges_box> boxes() const { return items(maq_edges_curves_get_box_count, maq_edges_curves_get_box); }

  maq_edges_curves_stats stats() const {
    maq_edges_curves_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_edges_curves_get_stats(get(), &stats));
    return stats;
  }

  maq_edges_snap snap_to_pixel(double x_px, double y_px, double radius_px) const {
    maq_edges_snap snap{};
    snap.struct_size = sizeof snap;
    check(maq_edges_curves_snap_to_pixel(get(), x_px, y_px, radius_px, &snap));
    return snap;
  }
  maq_edges_snap snap_to_ray(const std::array<double, 3>& origin_m, const std::array<double, 3>& direction,
                             double max_angle_rad) const {
    maq_edges_snap snap{};
    snap.struct_size = sizeof snap;
    check(maq_edges_curves_snap_to_ray(get(), origin_m.data(), direction.data(), max_angle_rad, &snap));
    return snap;
  }

  void save(const std::string& path) const { check(maq_edges_curves_save(get(), path.c_str())); }

 private:
  template <class T>
  std::vector<T> items(uint32_t (*count)(const maq_edges_curves*),
                       maq_status (*read)(const maq_edges_curves*, uint32_t, T*)) const {
    std::vector<T> all(count(get()));
    for (uint32_t i = 0; i < all.size(); ++i) {
      all[i].struct_size = sizeof(T);
      check(read(get(), i, &all[i]));
    }
    return all;
  }

  Owner<maq_edges_curves, maq_edges_curves_release> owner_;
};

class EdgesResult {
 public:
  // Takes ownership of a result from the C API.
  explicit EdgesResult(maq_edges_result* result) : owner_(result) { read_field(); }
  // Refers to the output in a pipeline's result.
  explicit EdgesResult(PartOf<maq_edges_result> part)
      : owner_(const_cast<maq_edges_result*>(part.handle), {std::move(part.whole)}) {
    read_field();
  }

  maq_edges_result* get() const { return owner_.get(); }
  const maq_edges_field& field() const { return field_; }
  int32_t width_px() const { return field_.width_px; }
  int32_t height_px() const { return field_.height_px; }

  // Planes of width_px() * height_px() values, row by row.
  const float* distance_r() const { return static_cast<const float*>(plane(MAQ_EDGES_PLANE_DISTANCE)); }
  const float* expected_error_r() const { return static_cast<const float*>(plane(MAQ_EDGES_PLANE_EXPECTED_ERROR)); }
  const uint8_t* kind() const { return static_cast<const uint8_t*>(plane(MAQ_EDGES_PLANE_KIND)); }
  const float* depth_m() const { return static_cast<const float*>(plane(MAQ_EDGES_PLANE_DEPTH)); }

  std::vector<float> distance_m() const {
    std::vector<float> metres(size_t(width_px()) * size_t(height_px()));
    check(maq_edges_result_copy_distance_m(get(), metres.data(), metres.size()));
    return metres;
  }

  maq_edges_stats stats() const {
    maq_edges_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_edges_result_get_stats(get(), &stats));
    return stats;
  }

  EdgesCurves find_curves(const maq_edges_curves_config& config = default_edges_curves_config()) const {
    maq_edges_curves* curves = nullptr;
    check(maq_edges_result_find_curves(get(), &config, &curves));
    return EdgesCurves(curves);
  }

  // Writes <path>_distance.png, <path>_kind.png and <path>_edges.json.
  void save(const std::string& path) const { check(maq_edges_result_save(get(), path.c_str())); }

 private:
  void read_field() {
    field_.struct_size = sizeof field_;
    check(maq_edges_result_get_field(get(), &field_));
  }

  const void* plane(maq_edges_plane which) const {
    const void* values = nullptr;
    size_t stride_bytes = 0;
    check(maq_edges_result_get_plane(get(), which, &values, &stride_bytes));
    return values;
  }

  Owner<maq_edges_result, maq_edges_result_release> owner_;
  maq_edges_field field_{};
};

class Edges {
 public:
  Edges(const Context& context, const maq_edges_config& config) { create(context, config); }
  // Loads the bundle installed with the library.
  explicit Edges(const Context& context) { create(context, default_edges_config()); }
  Edges(const Context& context, const std::string& bundle_path) {
    maq_edges_config config = default_edges_config();
    config.model.bundle_path = bundle_path.c_str();
    create(context, config);
  }

  maq_edges* get() const { return owner_.get(); }

  // The frame carries depth and intrinsics.
  EdgesResult run(const Frame& frame) {
    maq_edges_result* result = nullptr;
    check(maq_edges_run(get(), frame.get(), &result));
    return EdgesResult(result);
  }

  // From any thread: the running call, or else the next one, throws Error with MAQ_CANCELLED.
  void cancel() { check(maq_edges_cancel(get())); }

 private:
  void create(const Context& context, const maq_edges_config& config) {
    maq_edges* made = nullptr;
    check(maq_edges_create(context.get(), &config, &made));
    owner_.reset(made);
  }

  Owner<maq_edges, maq_edges_destroy> owner_;
};

// Joins the edges of several views (edges_fusion.h).
class EdgesFusion {
 public:
  explicit EdgesFusion(const Context& context, const maq_edges_fusion_config& config = default_edges_fusion_config()) {
    maq_edges_fusion* created = nullptr;
    check(maq_edges_fusion_create(context.get(), &config, &created));
    owner_.reset(created);
  }

  maq_edges_fusion* get() const { return owner_.get(); }

  void add_view(const EdgesResult& result, const maq_pinhole_camera& camera) {
    check(maq_edges_fusion_add_view(get(), result.get(), &camera));
  }
  void finish() { check(maq_edges_fusion_finish(get())); }
  void cancel() { check(maq_edges_fusion_cancel(get())); }

  maq_edges_fusion_info info() const {
    maq_edges_fusion_info info{};
    info.struct_size = sizeof info;
    check(maq_edges_fusion_get_info(get(), &info));
    return info;
  }
  std::vector<maq_edges_fusion_point> points() const {
    std::vector<maq_edges_fusion_point> points(size_t(info().point_count));
    check(maq_edges_fusion_copy_points(get(), points.data(), points.size()));
    return points;
  }
  EdgesCurves find_curves() const {
    maq_edges_curves* curves = nullptr;
    check(maq_edges_fusion_find_curves(get(), &curves));
    return EdgesCurves(curves);
  }

 private:
  Owner<maq_edges_fusion, maq_edges_fusion_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_EDGES_HPP_
