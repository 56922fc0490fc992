#include <algorithm>
#include <cmath>
#include <cstddef>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/edges/edges_handle.h"
#include "api/frame_handle.h"
#include "api/model_options.h"
#include "core/worker_threads.h"
#include "edges/field_files.h"

using namespace maq;

namespace {

constexpr uint32_t kResultPool = 4, kMaxResultPool = 64;

maq_edges_config default_edges_config() {
  maq_edges_config config{};
  config.struct_size = sizeof config;
  return config;
}

}  // namespace

maq_edges_config maq::read_edges_config(const maq_edges_config* given, const char* name) {
  return read_config(given, name, default_edges_config());
}

EdgesSettings maq::edges_settings(const maq_edges_config& config, const char* name) {
  const std::string prefix = std::string(name) + ".";
  require_model_options(prefix + "model", config.model);
  require_range(prefix + "result_pool_size", config.result_pool_size, 0u, kMaxResultPool);
  require_range(prefix + "skip_planes", config.skip_planes, 0, 1);
  require_range(prefix + "average_frames", config.average_frames, 0, DepthAverage::kMaxFrames);
  EdgesSettings settings;
  settings.threads = config.model.threads != 0 ? config.model.threads : default_threads();
  settings.provider = config.model.provider;
  settings.skips_planes = config.skip_planes == 1;
  settings.average_frames = std::max(config.average_frames, 1);
  return settings;
}

uint32_t maq::result_pool_size_of(const maq_edges_config& config) {
  return config.result_pool_size == 0 ? kResultPool : config.result_pool_size;
}

maq_status maq_edges_config_init(maq_edges_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_edges_config());
}

maq_status maq_edges_create(maq_context* context, const maq_edges_config* given, maq_edges** edges) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(edges, "edges");
    const maq_edges_config config = read_edges_config(given, "config");
    const EdgesSettings settings = edges_settings(config, "config");
    Bundle bundle = read_bundle_argument(config.model, "config.model", kEdgesBundle);
    const Manifest manifest = bundle.manifest;
    auto made = std::make_unique<Edges>(context->state->onnxruntime(), std::move(bundle), settings);
    context->state->log().write(MAQ_LOG_INFO, "Bundle ", manifest.name, " ", manifest.version, " (", manifest.precision,
                                ") loaded, ", made->threads(), " thread(s)");
    *edges = new maq_edges(context->state, std::move(made), result_pool_size_of(config));
    return MAQ_OK;
  });
}

void maq_edges_destroy(maq_edges* edges) { destroy(edges, "edges", __func__); }

maq_status maq_edges_run(maq_edges* edges, const maq_frame* frame, maq_edges_result** result) {
  return guarded_alone(edges, "edges", __func__, [&] {
    require_argument(frame, "frame");
    require_argument(result, "result");
    BoundedPool<maq_edges_result>::Pooled handle = edges->results.acquire();
    edges->edges->run(frame->frame, handle->result);
    const EdgesStats& stats = handle->result.stats;
    if (!edges->has_warned_of_unit && stats.far_pixels * 2 > stats.known_pixels) {
      edges->has_warned_of_unit = true;
      edges->state->log().write(MAQ_LOG_WARNING, "Of the known depth, ", 100 * stats.far_pixels / stats.known_pixels,
                                " % is beyond ", kFarDepthM,
                                " m, so its unit is probably wrong: all lengths would be. "
                                "Give depth of millimetres the unit 0.001 (depth_unit in a URI).");
    }
    handle->curves = edges->curves;
    *result = lend<maq_edges_result>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_edges_cancel(maq_edges* edges) {
  return guarded(edges, __func__, [&] {
    require_argument(edges, "edges");
    edges->edges->cancel();
    return MAQ_OK;
  });
}

void maq_edges_result_release(maq_edges_result* result) {
  return_handle(result, "result", __func__, return_to_pool<maq_edges_result>);
}

maq_status maq_edges_result_get_field(const maq_edges_result* result, maq_edges_field* field) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    const EdgeField& from = result->result.field;
    const Intrinsics& camera = from.intrinsics;
    maq_edges_field filled{};
    filled.width_px = from.width;
    filled.height_px = from.height;
    filled.eps_r = from.eps_r;
    filled.intrinsics = {camera.width_px, camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, {}};
    write_struct(field, "field", filled);
    return MAQ_OK;
  });
}

maq_status maq_edges_result_get_plane(const maq_edges_result* result, maq_edges_plane plane, const void** values,
                                      size_t* stride_bytes) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_argument(values, "values");
    require_argument(stride_bytes, "stride_bytes");
    const int32_t which = number_in(plane);
    require_range("plane", which, int32_t(MAQ_EDGES_PLANE_DISTANCE), int32_t(MAQ_EDGES_PLANE_DEPTH));
    const EdgeField& field = result->result.field;
    const void* const all[] = {field.distance_r.data(), field.expected_error_r.data(), field.kind.data(),
                               field.depth_m.data()};
    *values = all[which - MAQ_EDGES_PLANE_DISTANCE];
    *stride_bytes = size_t(field.width) * (which == MAQ_EDGES_PLANE_KIND ? sizeof(uint8_t) : sizeof(float));
    return MAQ_OK;
  });
}

maq_status maq_edges_result_copy_distance_m(const maq_edges_result* result, float* distance_m, size_t count) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_argument(distance_m, "distance_m");
    const EdgeField& field = result->result.field;
    if (count < field.distance_r.size()) {
      throw ArgumentError("count is ", count, ", but the field has ", field.distance_r.size(), " pixels.");
    }
    const float per_px = float(1 / std::sqrt(field.intrinsics.fx_px * field.intrinsics.fy_px));
    std::transform(field.distance_r.begin(), field.distance_r.end(), field.depth_m.begin(), distance_m,
                   [per_px](float distance_r, float depth_m) { return distance_r * (depth_m * per_px); });
    return MAQ_OK;
  });
}

maq_status maq_edges_result_get_stats(const maq_edges_result* result, maq_edges_stats* stats) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    const EdgesStats& from = result->result.stats;
    maq_edges_stats filled{};
    filled.depth_ms = from.depth_ms;
    filled.skip_ms = from.skip_ms;
    filled.slopes_ms = from.slopes_ms;
    filled.network_ms = from.network_ms;
    filled.decode_ms = from.decode_ms;
    filled.total_ms = from.total_ms;
    filled.known_pixel_count = from.known_pixels;
    filled.network_pixel_count = from.network_pixels;
    filled.broken_pixel_count = from.broken_pixels;
    filled.provider = from.provider;
    filled.threads = from.threads;
    filled.is_threads_measured = from.is_threads_measured ? 1 : 0;
    filled.averaged_pixel_count = from.averaged_pixels;
    filled.far_pixel_count = from.far_pixels;
    write_struct(stats, "stats", filled);
    return MAQ_OK;
  });
}

maq_status maq_edges_result_save(const maq_edges_result* result, const char* path) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_argument(path, "path");
    const size_t length = std::strlen(path);
    if (length == 0 || path[length - 1] == '/') {
      throw ArgumentError("path is \"", path, "\", but must end with the beginning of a file name: results/box.");
    }
    write_field_files(result->result.field, path);
    return MAQ_OK;
  });
}
