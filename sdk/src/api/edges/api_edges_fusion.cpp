#include <atomic>
#include <memory>

#include "api/boundary.h"
#include "api/camera_argument.h"
#include "api/edges/edges_handle.h"
#include "core/clock.h"
#include "core/worker_threads.h"
#include "edges/curves/curve_extractor.h"
#include "edges/fusion/curve_fusion.h"
#include "edges/fusion/field_fusion.h"
#include "maquette/edges_fusion.h"

using namespace maq;

namespace {

constexpr size_t kCurvesPool = 4;
constexpr float kFractionOfPoints = 0.9f;  // share of the points in the time of finish; the rest is for curves

maq_edges_fusion_config default_fusion_config() {
  maq_edges_fusion_config config{};
  config.struct_size = sizeof config;
  return config;
}

FusionOptions fusion_options(const maq_edges_fusion_config& config) {
  constexpr uint64_t kMaxCount = uint64_t(1) << 32;
  require_range("config.threads", config.threads, 0, kMaxThreads);
  require_range("config.cell_m", config.cell_m, 0.0, 1e9);
  require_range("config.max_points", config.max_points, uint64_t(0), kMaxCount - 2);
  require_range("config.min_views", config.min_views, 0, 1000);
  FusionOptions options;
  options.cell_m = config.cell_m;
  if (config.max_points != 0) options.max_points = int64_t(config.max_points);
  return options;
}

CurveFusionOptions curve_options(const maq_edges_fusion_config& config) {
  CurveFusionOptions options;
  if (config.min_views != 0) options.min_views = config.min_views;
  return options;
}

}  // namespace

struct maq_edges_fusion : HandleOf<HandleKind::kEdgesFusion> {
  explicit maq_edges_fusion(const maq_edges_fusion_config& given)
      : config(given),
        threads(given.threads > 0 ? given.threads : default_threads()),
        fields(fusion_options(given)),
        curves(curve_options(given)) {}
  maq_edges_fusion_config config;
  WorkerThreads threads;
  FieldFusion fields;
  CurveFusion curves;
  CurveExtractor extractor;
  std::atomic<bool> is_cancelled{false};
  FusedField found;
  EdgeCurves found_curves;
  float fusion_ms = 0;
  mutable BoundedPool<maq_edges_curves> lent{kCurvesPool, "curves"};
};

maq_status maq_edges_fusion_config_init(maq_edges_fusion_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_fusion_config());
}

maq_status maq_edges_fusion_create(maq_context* context, const maq_edges_fusion_config* given,
                                   maq_edges_fusion** fusion) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(fusion, "fusion");
    const maq_edges_fusion_config config = read_config(given, "config", default_fusion_config());
    fusion_options(config);  // checks the config before threads start
    *fusion = new maq_edges_fusion(config);
    return MAQ_OK;
  });
}

void maq_edges_fusion_destroy(maq_edges_fusion* fusion) { destroy(fusion, "fusion", __func__); }

maq_status maq_edges_fusion_add_view(maq_edges_fusion* fusion, const maq_edges_result* result,
                                     const maq_pinhole_camera* camera) {
  return guarded_alone(fusion, "fusion", __func__, [&] {
    require_argument(result, "result");
    require_argument(camera, "camera");
    require_struct_size("camera", camera->struct_size, sizeof(maq_pinhole_camera));
    const EdgeField& field = result->result.field;
    PinholeCamera pose = pinhole_of(*camera);
    if (pose.width_px == 0 && pose.height_px == 0) pose.intrinsics() = field.intrinsics;
    const EdgeCurves& curves = fusion->extractor.extract(field);
    fusion->fields.add_view(field, pose);
    fusion->curves.add_view(curves, pose);
    return MAQ_OK;
  });
}

maq_status maq_edges_fusion_finish(maq_edges_fusion* fusion) {
  return guarded_alone(fusion, "fusion", __func__, [&] {
    const Stopwatch total;
    fusion->found = {};
    fusion->found_curves = {};
    const auto report = [&](float done) {
      const auto callback = fusion->config.progress_callback;
      if (callback == nullptr) return;
      const auto call = [&] { return callback(fusion->config.progress_user_data, double(done)); };
      if (call_app("config.progress_callback", call) == 0) fusion->is_cancelled = true;
    };
    try {
      FusedField found;
      fusion->fields.fuse(
          fusion->threads, fusion->is_cancelled, [&](float done) { report(done * kFractionOfPoints); }, found);
      if (fusion->is_cancelled) throw Error(MAQ_CANCELLED, "The fusion was cancelled.");
      fusion->curves.fuse(found.origin, fusion->found_curves);
      fusion->found = std::move(found);
      report(1);
    } catch (...) {
      fusion->is_cancelled = false;
      throw;
    }
    fusion->is_cancelled = false;  // a later request cancels the next call
    fusion->fusion_ms = float(total.elapsed_ms());
    return MAQ_OK;
  });
}

maq_status maq_edges_fusion_cancel(maq_edges_fusion* fusion) {
  return guarded(fusion, __func__, [&] {
    require_argument(fusion, "fusion");
    fusion->is_cancelled = true;
    return MAQ_OK;
  });
}

maq_status maq_edges_fusion_get_info(const maq_edges_fusion* fusion, maq_edges_fusion_info* info) {
  return guarded_alone(fusion, "fusion", __func__, [&] {
    maq_edges_fusion_info filled{};
    filled.view_count = uint32_t(fusion->fields.views());
    filled.empty_view_count = uint32_t(fusion->fields.views_without_depth());
    filled.point_count = fusion->found.points.size();
    filled.outside_pixel_count = uint64_t(fusion->found.outside_pixels);
    filled.thin_point_count = uint64_t(fusion->found.mixed_points);
    filled.cell_m = fusion->found.cell_m;
    filled.eps_r = fusion->found.eps_r;
    filled.fusion_ms = fusion->fusion_ms;
    write_struct(info, "info", filled);
    return MAQ_OK;
  });
}

maq_status maq_edges_fusion_copy_points(const maq_edges_fusion* fusion, maq_edges_fusion_point* points, size_t count) {
  return guarded_alone(fusion, "fusion", __func__, [&] {
    const FusedField& found = fusion->found;
    if (count < found.points.size()) {
      throw ArgumentError("count is ", count, ", but there are ", found.points.size(), " points.");
    }
    if (!found.points.empty()) require_argument(points, "points");
    for (const FusedPoint& from : found.points) {
      *points++ = {{from.point.x + found.origin[0], from.point.y + found.origin[1], from.point.z + found.origin[2]},
                   {float(from.normal.x), float(from.normal.y), float(from.normal.z)},
                   from.distance_m,
                   from.r_m,
                   uint32_t(from.views)};
    }
    return MAQ_OK;
  });
}

maq_status maq_edges_fusion_find_curves(const maq_edges_fusion* fusion, maq_edges_curves** curves) {
  return guarded_alone(fusion, "fusion", __func__, [&] {
    require_argument(curves, "curves");
    BoundedPool<maq_edges_curves>::Pooled handle = fusion->lent.acquire();
    handle->found = {};
    handle->found.curves = fusion->found_curves;
    *curves = lend<maq_edges_curves>(std::move(handle));
    return MAQ_OK;
  });
}
