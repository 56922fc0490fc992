#include <algorithm>

#include "api/boundary.h"
#include "api/scene/scene_handles.h"
#include "core/worker_threads.h"
#include "scene/format/ply_writer.h"
#include "scene/format/scene_file.h"
#include "scene/splats/files/splat_files.h"
#include "scene/splats/splat_discs.h"

using namespace maq;

namespace {

// Throws for what only a scene of points can do.
void require_points(const maq_scene& scene) {
  if (scene.splats) {
    throw Error(MAQ_ERROR_UNSUPPORTED,
                "The scene has splats, which cannot be written as points; write them to a .ply, .spz or .glb file.");
  }
}

maq_scene_info info_of(const Splats& from) {
  maq_scene_info info{};
  info.coefficient_bits = from.stored_bits;
  info.point_count = from.count();
  info.view_dependent_count = from.sh_degree > 0 ? from.count() : 0;
  const auto [low, high] = bounds_of(from);
  std::copy_n(from.up.begin(), 3, info.up);
  std::copy_n(low.begin(), 3, info.bounds_min);
  std::copy_n(high.begin(), 3, info.bounds_max);
  return info;
}

maq_scene_info info_of(const Scene& from) {
  maq_scene_info info{};
  switch (from.coefficient_format) {
    case CoefficientFormat::kInt8: info.coefficient_bits = 8; break;
    case CoefficientFormat::kInt16: info.coefficient_bits = 16; break;
    case CoefficientFormat::kFloat32: info.coefficient_bits = 32; break;
  }
  info.point_count = from.points;
  info.view_dependent_count = from.view_dependent;
  info.block_count = from.block_count;
  const SceneBounds bounds = bounds_of(from);
  std::copy_n(from.up.begin(), 3, info.up);
  std::copy_n(bounds.low.begin(), 3, info.bounds_min);
  std::copy_n(bounds.high.begin(), 3, info.bounds_max);
  std::copy(from.networks_sha256.begin(), from.networks_sha256.end(), info.networks_sha256);
  return info;
}

}  // namespace

maq_status maq_scene_open(maq_context* context, const char* path, maq_scene** scene) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(path, "path");
    require_argument(scene, "scene");
    *scene = is_splat_file(path) ? new maq_scene(read_splat_file(path)) : new maq_scene(open_scene_file(path));
    return MAQ_OK;
  });
}

maq_status maq_scene_open_memory(maq_context* context, const void* data, size_t size_bytes, maq_scene** scene) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(data, "data");
    require_argument(scene, "scene");
    *scene = new maq_scene(open_scene_memory(data, size_bytes));
    return MAQ_OK;
  });
}

void maq_scene_destroy(maq_scene* scene) { destroy(scene, "scene", __func__); }

maq_status maq_scene_save(const maq_scene* scene, const char* path) {
  return guarded(scene, __func__, [&] {
    require_argument(scene, "scene");
    require_argument(path, "path");
    if (is_name_of_splats(path)) {
      WorkerThreads threads(default_threads());
      write_splat_file(scene->splats ? *scene->splats : splats_of_points(scene->scene, threads), path);
    } else {
      require_points(*scene);
      write_scene_file(scene->scene, path);
    }
    return MAQ_OK;
  });
}

maq_status maq_scene_save_ply(const maq_scene* scene, const char* path) {
  return guarded(scene, __func__, [&] {
    require_argument(scene, "scene");
    require_argument(path, "path");
    require_points(*scene);
    write_scene_ply(scene->scene, path);
    return MAQ_OK;
  });
}

maq_status maq_scene_get_info(const maq_scene* scene, maq_scene_info* info) {
  return guarded(scene, __func__, [&] {
    require_argument(scene, "scene");
    write_struct(info, "info", scene->splats ? info_of(*scene->splats) : info_of(scene->scene));
    return MAQ_OK;
  });
}

maq_status maq_scene_get_build_stats(const maq_scene* scene, maq_scene_build_stats* stats) {
  return guarded(scene, __func__, [&] {
    require_argument(scene, "scene");
    if (!scene->build_stats) {
      throw Error(MAQ_ERROR_NOT_FOUND, "The scene was opened from a file, which has no stats of its build.");
    }
    write_struct(stats, "stats", *scene->build_stats);
    return MAQ_OK;
  });
}
