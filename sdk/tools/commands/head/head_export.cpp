#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>

#include "arguments/bundle_argument.h"
#include "commands/head/head_commands.h"
#include "output/output_file.h"
#include "print.h"
#include "program.h"

namespace {

struct HeadExportOptions {
  std::string head, out, bundle;
  MeshChoice mesh;
};

std::string check_mesh_name(const std::string& path) {
  const std::string ending = std::filesystem::u8path(path).extension().string();
  return ending == ".glb" || ending == ".obj" || ending == ".ply" ? std::string()
                                                                  : path + " must end with .glb, .obj or .ply";
}

std::string check_triangles(const std::string& text) {
  const CLI::Range triangles(100u, MAQ_HEAD_ALL_TRIANGLES - 1);
  return text == "all" || triangles(text).empty() ? std::string() : text + " is neither 100 or more nor \"all\"";
}

int export_head(const HeadExportOptions& options) {
  maq_head_mesh_config config = mesh_config(options.mesh);
  const std::string bundle = bundle_of_mesh(config, options.bundle);
  config.model.bundle_path = bundle.empty() ? nullptr : bundle.c_str();
  const maquette::Context context = open_context();
  const maquette::HeadMesh mesh(maquette::Head::open(context, options.head), config);
  make_folder_of(options.out);
  mesh.save(options.out);
  print_output("%s", text_of_mesh(options.out, mesh.data()).c_str());
  return 0;
}

}  // namespace

void add_mesh_choice(CLI::App& command, MeshChoice& choice) {
  command
      .add_option("--triangles", choice.triangles,
                  "Make the dense, closed surface of about this many triangles, or all, instead of the animatable head")
      ->check(CLI::Validator(check_triangles, "100 or more, or all"));
  command
      .add_option("--cell", choice.cell_mm,
                  "Make the dense surface with this distance between vertices before triangles are removed, mm "
                  "(default 2.1, or 1.6 for more than 60000 triangles)")
      ->check(CLI::Range(0.5, 20.0));
}

maq_head_mesh_config mesh_config(const MeshChoice& choice) {
  maq_head_mesh_config mesh = maquette::default_head_mesh_config();
  mesh.cell_m = choice.cell_mm * 1e-3;
  if (choice.triangles == "all")
    mesh.triangle_count = MAQ_HEAD_ALL_TRIANGLES;
  else if (!choice.triangles.empty())
    mesh.triangle_count = uint32_t(std::stoul(choice.triangles));
  return mesh;
}

void add_template_bundle_option(CLI::App& command, std::string& bundle) {
  command.add_option("--bundle", bundle,
                     "Folder of the bundle with the template head; default: MAQ_HEADS_BUNDLE, then the installed one");
}

std::string bundle_of_mesh(const maq_head_mesh_config& mesh, const std::string& named) {
  const bool is_dense = mesh.triangle_count != 0 || mesh.cell_m != 0;
  return is_dense ? std::string() : bundle_or_default(kHeadsNetworks, named);
}

CLI::Option* add_mesh_file_option(CLI::App& command, std::string& path) {
  return command.add_option("-o,--out", path, "Mesh to write: .glb (for most programs), .obj or .ply")
      ->check(CLI::Validator(check_mesh_name, ".glb, .obj or .ply"));
}

std::string text_of_mesh(const std::string& path, const maq_head_mesh_data& mesh) {
  char text[160];
  std::string more;
  if (mesh.simplification_error_m > 0) {
    std::snprintf(text, sizeof text, ", within %.2f mm of the full mesh", 1e3 * double(mesh.simplification_error_m));
    more = text;
  }
  if (mesh.morph_target_count > 0) more += ", " + std::to_string(mesh.morph_target_count) + " morph targets";
  std::snprintf(text, sizeof text, ": %u vertices, %u triangles", mesh.vertex_count, mesh.triangle_count);
  return path + text + more + "\n";
}

void add_head_export_command(CLI::App& head, int* exit_code) {
  auto options = std::make_shared<HeadExportOptions>();
  CLI::App* command = head.add_subcommand("export", "Write the mesh of a saved head, without its photos");
  command->add_option("head", options->head, "File that `maquette head --save` wrote")->required();
  add_mesh_file_option(*command, options->out)->required();
  add_mesh_choice(*command, options->mesh);
  add_template_bundle_option(*command, options->bundle);
  command->footer(
      "Examples:\n"
      "  maquette head export head.maqh --out head.glb\n"
      "  maquette head export head.maqh --out surface.ply --triangles all");
  command->callback([=] { *exit_code = export_head(*options); });
}
