#include <algorithm>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/frame_handle.h"
#include "api/head/head_handle.h"
#include "core/worker_threads.h"
#include "head/reconstruction/head_scale.h"
#include "head/reconstruction/head_surface.h"
#include "head/reconstruction/head_texture.h"
#include "head/reconstruction/registered_template.h"
#include "head/bundle/head_bundle.h"
#include "head/files/head_file.h"
#include "head/mesh/mesh_files.h"

using namespace maq;

namespace {

constexpr float kDecimetre_m = 0.1f;

std::vector<float> in_metres(std::vector<float> decimetres) {
  for (float& value : decimetres) value *= kDecimetre_m;
  return decimetres;
}

constexpr uint32_t kDefaultTriangles = 60000, kMinTriangles = 100;

maq_head_mesh_options default_mesh_options() {
  maq_head_mesh_options options{};
  options.struct_size = sizeof options;
  return options;
}

head::SurfaceOptions surface_options(const maq_head_mesh_options& options) {
  head::SurfaceOptions surface;
  if (number_in(options.topology) == MAQ_HEAD_TOPOLOGY_TEMPLATE &&
      (options.cell_m != 0 || options.triangle_count != 0)) {
    throw ArgumentError(
        "options.cell_m and options.triangle_count must be 0 with the template's topology, whose triangles are given.");
  }
  if (options.cell_m != 0) {
    require_range("options.cell_m", options.cell_m, head::kMinSurfaceCell_m, head::kMaxSurfaceCell_m);
    surface.cell_m = options.cell_m;
  }
  if (options.triangle_count == 0) {
    surface.triangles = options.cell_m != 0 ? head::kAllTriangles : kDefaultTriangles;
  } else if (options.triangle_count != MAQ_HEAD_ALL_TRIANGLES) {
    require_range("options.triangle_count", options.triangle_count, kMinTriangles, MAQ_HEAD_ALL_TRIANGLES);
    surface.triangles = options.triangle_count;
  }
  return surface;
}

// The head's own, or that of the bundle that the options name.
const head::HeadTemplate& template_of(maq_head& head, const maq_head_mesh_options& options) {
  if (head.template_head == nullptr) {
    head.template_head = head::template_of_bundle(read_bundle_argument(options, "options", kHeadsBundle));
  }
  if (head.template_head == nullptr) {
    throw Error(MAQ_ERROR_UNSUPPORTED,
                "The bundle has no template head, so meshes cannot have its topology. Use a bundle of this version of "
                "Maquette, or the field's topology.");
  }
  return *head.template_head;
}

// The same head of another size.
maq_head* scaled_copy(const maq_head& head, const head::HeadScale& scale) {
  head::StoredHead made = head.head;
  made.scale = scale;
  if (const std::string fault = head::stored_head_fault(made); !fault.empty()) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The head cannot have that size: ", fault, ".");
  }
  return new maq_head(std::move(made), head.threads, head.template_head);
}

}  // namespace

const std::vector<uint8_t>& texture_of(const maq_head& head) {
  static const std::vector<uint8_t> kNone;
  return head.mesh_topology == MAQ_HEAD_TOPOLOGY_TEMPLATE ? kNone : head.head.texture.jpeg;
}

const head::HeadMesh& mesh_of(maq_head& head, const maq_head_mesh_options* given) {
  const maq_head_mesh_options options = read_config(given, "options", default_mesh_options());
  const int32_t topology = number_in(options.topology);
  require_range("options.topology", topology, int32_t(MAQ_HEAD_TOPOLOGY_FIELD), int32_t(MAQ_HEAD_TOPOLOGY_TEMPLATE));
  const head::SurfaceOptions wanted = surface_options(options);
  if (head.mesh_topology == options.topology && head.mesh_options.cell_m == wanted.cell_m &&
      head.mesh_options.triangles == wanted.triangles) {
    return head.mesh;
  }
  WorkerThreads threads(head.threads);
  head::SurfaceStats stats;
  head::HeadMesh mesh;
  if (topology == MAQ_HEAD_TOPOLOGY_TEMPLATE) {
    mesh = head::registered_template(head.head, template_of(head, options), threads);
  } else {
    mesh = head::head_surface(head.head, wanted, threads, &stats);
    if (head.head.texture.side_px > 0) head::set_texture_coordinates(head.head, mesh);
  }
  std::vector<float> positions_m = in_metres(mesh.positions), template_points_m = in_metres(mesh.template_points);
  std::vector<std::vector<float>> morph_moves_m;
  for (const head::MorphTarget& target : mesh.morph_targets) morph_moves_m.push_back(in_metres(target.moves));
  head.mesh = std::move(mesh);
  head.positions_m = std::move(positions_m);
  head.template_points_m = std::move(template_points_m);
  head.morph_moves_m = std::move(morph_moves_m);
  head.mesh_stats = stats;
  head.mesh_topology = options.topology;
  head.mesh_options = wanted;
  return head.mesh;
}

maq_status maq_head_open(maq_context* context, const char* path, maq_head** head) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(path, "path");
    require_argument(head, "head");
    *head = new maq_head(head::read_head_file(path), default_threads());
    return MAQ_OK;
  });
}

maq_status maq_head_open_memory(maq_context* context, const void* data, size_t size_bytes, maq_head** head) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(data, "data");
    require_argument(head, "head");
    *head = new maq_head(head::read_head(data, size_bytes, "The head in memory"), default_threads());
    return MAQ_OK;
  });
}

maq_status maq_head_scale_by_distance(maq_head* head, const char* from, const char* to, double distance_m,
                                      maq_head** scaled) {
  return guarded_alone(head, "head", __func__, [&] {
    require_argument(from, "from");
    require_argument(to, "to");
    require_argument(scaled, "scaled");
    *scaled = scaled_copy(*head, head::scale_by_distance(head->head, from, to, distance_m));
    return MAQ_OK;
  });
}

maq_status maq_head_scale_by_depth(maq_head* head, uint32_t index, const maq_frame* frame, maq_head** scaled) {
  return guarded_alone(head, "head", __func__, [&] {
    require_argument(frame, "frame");
    require_argument(scaled, "scaled");
    require_index("index", index, head->head.cameras.size());
    const ImageView* const depth = depth_of(frame->frame);
    WorkerThreads threads(head->threads);
    *scaled = scaled_copy(
        *head, head::scale_by_depth(head->head, index, depth == nullptr ? frame->frame.image : *depth, threads));
    return MAQ_OK;
  });
}

maq_status maq_head_save(const maq_head* head, const char* path) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    require_argument(path, "path");
    head::write_head_file(head->head, path);
    return MAQ_OK;
  });
}

void maq_head_destroy(maq_head* head) { destroy(head, "head", __func__); }

maq_status maq_head_get_info(const maq_head* head, maq_head_info* info) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    const head::StoredHead& from = head->head;
    maq_head_info filled{};
    filled.photo_count = uint32_t(from.cameras.size());
    filled.landmark_count = uint32_t(from.places.size());
    filled.scale = maq_head_scale(from.scale.source);
    filled.scale_sigma = float(from.scale.sigma / from.scale.metres_per_unit);
    filled.texture_px = uint32_t(from.texture.side_px);
    write_struct(info, "info", filled);
    return MAQ_OK;
  });
}

const char* maq_head_get_landmark_name(const maq_head* head, uint32_t index) {
  const char* name = nullptr;
  guarded(head, __func__, [&] {
    require_argument(head, "head");
    if (index < head->head.places.size()) name = head->head.places[index].name.c_str();
    return MAQ_OK;
  });
  return name;
}

maq_status maq_head_get_landmark(const maq_head* head, const char* name, maq_head_landmark* landmark) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    require_argument(name, "name");
    const head::HeadPlace place = head::find_head_place(head->head, name);
    const double metres = head->head.scale.metres_per_unit;
    maq_head_landmark filled{};
    filled.sigma_m = float(place.sigma * metres);
    filled.point_m[0] = place.point.x * metres;
    filled.point_m[1] = place.point.y * metres;
    filled.point_m[2] = place.point.z * metres;
    write_struct(landmark, "landmark", filled);
    return MAQ_OK;
  });
}

maq_status maq_head_mesh_options_init(maq_head_mesh_options* options, uint32_t struct_size) {
  return init_config(__func__, options, struct_size, default_mesh_options(), "options");
}

maq_status maq_head_get_mesh(maq_head* head, const maq_head_mesh_options* options, maq_head_mesh* mesh) {
  return guarded_alone(head, "head", __func__, [&] {
    require_argument(mesh, "mesh");
    require_struct_size("mesh", mesh->struct_size, sizeof(maq_head_mesh));
    const head::HeadMesh& made = mesh_of(*head, options);
    maq_head_mesh filled{};
    filled.vertex_count = uint32_t(made.vertex_count());
    filled.triangle_count = uint32_t(made.triangle_count());
    filled.positions_m = head->positions_m.data();
    filled.normals = made.normals.data();
    filled.colours_rgb = made.colours.data();
    filled.template_points_m = head->template_points_m.data();
    filled.triangles = made.triangles.data();
    if (!made.texture_coordinates.empty()) filled.texture_coordinates = made.texture_coordinates.data();
    const std::vector<uint8_t>& texture = texture_of(*head);
    if (!texture.empty()) {
      filled.texture_jpeg = texture.data();
      filled.texture_bytes = uint32_t(texture.size());
    }
    filled.morph_target_count = uint32_t(made.morph_targets.size());
    filled.simplification_error_m = float(head->mesh_stats.error_m);
    write_struct(mesh, "mesh", filled);
    return MAQ_OK;
  });
}

maq_status maq_head_get_morph_target(const maq_head* head, uint32_t index, maq_head_morph_target* target) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    require_index("index", index, head->mesh.morph_targets.size());
    const head::MorphTarget& from = head->mesh.morph_targets[index];
    maq_head_morph_target filled{};
    filled.vertex_count = uint32_t(from.vertices.size());
    filled.name = from.name.c_str();
    filled.vertices = from.vertices.data();
    filled.moves_m = head->morph_moves_m[index].data();
    write_struct(target, "target", filled);
    return MAQ_OK;
  });
}

maq_status maq_head_export(maq_head* head, const char* path, const maq_head_mesh_options* options) {
  return guarded_alone(head, "head", __func__, [&] {
    require_argument(path, "path");
    head::require_mesh_file_name(path);
    const head::HeadMesh& mesh = mesh_of(*head, options);
    head::write_mesh_file(mesh, path, texture_of(*head));
    return MAQ_OK;
  });
}
