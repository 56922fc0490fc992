#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/head/head_handle.h"
#include "api/model_options.h"
#include "core/worker_threads.h"
#include "head/bundle/head_bundle.h"
#include "head/mesh/file_axes.h"
#include "head/mesh/mesh_files.h"
#include "head/reconstruction/head_surface.h"
#include "head/reconstruction/head_texture.h"
#include "head/reconstruction/registered_template.h"

using namespace maq;

namespace {

constexpr uint32_t kMinTriangles = 100;

std::vector<float> in_metres(const std::vector<float>& decimetres) {
  return head::to_file_axes(decimetres, [](const float*) { return 0.1; });
}

maq_head_mesh_config default_mesh_config() {
  maq_head_mesh_config config{};
  config.struct_size = sizeof config;
  return config;
}

head::SurfaceOptions surface_options(const maq_head_mesh_config& config) {
  head::SurfaceOptions surface;
  if (config.cell_m != 0) {
    require_range("config.cell_m", config.cell_m, head::kMinSurfaceCell_m, head::kMaxSurfaceCell_m);
    surface.cell_m = config.cell_m;
  }
  if (config.triangle_count != 0 && config.triangle_count != MAQ_HEAD_ALL_TRIANGLES) {
    require_range("config.triangle_count", config.triangle_count, kMinTriangles, MAQ_HEAD_ALL_TRIANGLES);
    surface.triangles = config.triangle_count;
  }
  return surface;
}

// The template of the head, or of the bundle that the config names.
std::shared_ptr<const head::HeadTemplate> template_of(const maq_head& head, const maq_head_mesh_config& config) {
  if (head.template_head != nullptr) return head.template_head;
  auto found = head::template_of_bundle(read_bundle_argument(config.model, "config.model", kHeadsBundle));
  if (found == nullptr) {
    throw Error(MAQ_ERROR_UNSUPPORTED,
                "The bundle has no template head, so there is no animatable mesh. Use a bundle of this version of "
                "Maquette, or give config.triangle_count for the dense surface.");
  }
  return found;
}

std::unique_ptr<maq_head_mesh> mesh_of(const maq_head& head, const maq_head_mesh_config& config) {
  require_model_options("config.model", config.model, ThreadMeasuring::kUnsupported);
  const head::SurfaceOptions surface = surface_options(config);
  WorkerThreads threads(config.model.threads != 0 ? config.model.threads : head.threads);
  auto made = std::make_unique<maq_head_mesh>();
  if (config.triangle_count == 0 && config.cell_m == 0) {
    const auto onto = template_of(head, config);
    head::TemplateRegistration registration;
    made->mesh = head::registered_template(head.head, *onto, threads, &registration);
    made->texture_jpeg = head::texture_of_template(head.head, *onto, made->mesh, registration, threads);
  } else {
    head::SurfaceStats stats;
    made->mesh = head::head_surface(head.head, surface, threads, &stats);
    made->simplification_error_m = float(stats.error_m);
    if (head.head.texture.side_px > 0) {
      head::set_texture_coordinates(head.head, made->mesh);
      made->texture_jpeg = head.head.texture.jpeg;
    }
  }
  made->positions_m = in_metres(made->mesh.positions);
  made->normals = head::normals_in_file(made->mesh);
  made->template_points_m = in_metres(made->mesh.template_points);
  for (const head::MorphTarget& target : made->mesh.morph_targets) {
    made->morph_deltas_m.push_back(in_metres(target.deltas));
  }
  return made;
}

}  // namespace

maq_status maq_head_mesh_config_init(maq_head_mesh_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_mesh_config());
}

maq_status maq_head_mesh_create(const maq_head* head, const maq_head_mesh_config* given, maq_head_mesh** mesh) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    require_argument(mesh, "mesh");
    *mesh = mesh_of(*head, read_config(given, "config", default_mesh_config())).release();
    return MAQ_OK;
  });
}

void maq_head_mesh_destroy(maq_head_mesh* mesh) { destroy(mesh, "mesh", __func__); }

maq_status maq_head_mesh_get_data(const maq_head_mesh* mesh, maq_head_mesh_data* data) {
  return guarded(mesh, __func__, [&] {
    require_argument(mesh, "mesh");
    const head::HeadMesh& from = mesh->mesh;
    maq_head_mesh_data filled{};
    filled.vertex_count = uint32_t(from.vertex_count());
    filled.triangle_count = uint32_t(from.triangle_count());
    filled.morph_target_count = uint32_t(from.morph_targets.size());
    filled.positions_m = mesh->positions_m.data();
    filled.normals = mesh->normals.data();
    filled.colours_rgb = from.colours.data();
    filled.template_points_m = mesh->template_points_m.data();
    filled.triangles = from.triangles.data();
    if (!from.texture_coordinates.empty()) filled.texture_coordinates = from.texture_coordinates.data();
    if (!mesh->texture_jpeg.empty()) {
      filled.texture_jpeg = mesh->texture_jpeg.data();
      filled.texture_bytes = uint32_t(mesh->texture_jpeg.size());
    }
    filled.simplification_error_m = mesh->simplification_error_m;
    write_struct(data, "data", filled);
    return MAQ_OK;
  });
}

maq_status maq_head_mesh_get_morph_target(const maq_head_mesh* mesh, uint32_t index, maq_head_morph_target* target) {
  return guarded(mesh, __func__, [&] {
    require_argument(mesh, "mesh");
    require_index("index", index, mesh->mesh.morph_targets.size());
    const head::MorphTarget& from = mesh->mesh.morph_targets[index];
    maq_head_morph_target filled{};
    filled.vertex_count = uint32_t(from.vertices.size());
    filled.name = from.name.c_str();
    filled.vertices = from.vertices.data();
    filled.deltas_m = mesh->morph_deltas_m[index].data();
    write_struct(target, "target", filled);
    return MAQ_OK;
  });
}

maq_status maq_head_mesh_save(const maq_head_mesh* mesh, const char* path) {
  return guarded(mesh, __func__, [&] {
    require_argument(mesh, "mesh");
    require_argument(path, "path");
    head::write_mesh_file(mesh->mesh, path, mesh->texture_jpeg);
    return MAQ_OK;
  });
}
