#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <stdexcept>

#include "arguments/bundle_argument.h"
#include "commands/commands.h"
#include "commands/scene_commands.h"
#include "output/output_file.h"
#include "print.h"
#include "program.h"

namespace {

struct MakeOptions {
  std::string source;
  std::string out;
  std::string photos;
  std::string threads;
};

// The program has no code that finds cameras of photos; the Python package does it by COLMAP.
[[noreturn]] void tell_about_python(const MakeOptions& options) {
  throw std::runtime_error(
      "`scene make` finds the cameras of photos by a package of Python, which this program does not have. Run: pip "
      "install 'maquette[scenes]', then: python -m maquette scene make " +
      options.source + " --out " + options.out + (options.photos.empty() ? "" : " --photos " + options.photos) +
      (options.threads.empty() ? "" : " --threads " + options.threads));
}

struct InfoOptions {
  std::string scene;
  std::string json;
};

int show(const InfoOptions& options) {
  require_writable(options.json);
  const maquette::Context context = open_context();
  const maquette::Scene scene(context, options.scene);
  const maq_scene_info info = scene.info();
  const uint64_t bytes = std::filesystem::file_size(options.scene);
  print_output("%s: %.1f MB\n", options.scene.c_str(), double(bytes) / 1e6);
  const double each = double(bytes) / double(info.point_count);
  if (info.block_count == 0) {
    print_output("  splats     %" PRIu64 ", %.1f bytes each; their colours are %s\n", info.point_count, each,
                 info.view_dependent_count > 0 ? "view-dependent" : "constant");
  } else {
    print_output("  points     %" PRIu64 ", %.1f bytes each; %" PRIu64 " blocks\n", info.point_count, each,
                 info.block_count);
    print_output("  of these   %" PRIu64
                 " (%.0f %%) depend on the view, the rest are constant; %d bits a coefficient\n",
                 info.view_dependent_count, 100.0 * double(info.view_dependent_count) / double(info.point_count),
                 info.coefficient_bits);
  }
  print_output("  box        %g %g %g to %g %g %g\n", info.bounds_min[0], info.bounds_min[1], info.bounds_min[2],
               info.bounds_max[0], info.bounds_max[1], info.bounds_max[2]);
  print_output("  up         %g %g %g\n", info.up[0], info.up[1], info.up[2]);
  write_json_file(options.json, describe_scene(info, bytes), 2);
  return 0;
}

struct ExportOptions {
  std::string scene;
  std::string out;
};

int export_splats(const ExportOptions& options) {
  const std::string kind = std::filesystem::u8path(options.out).extension().string();
  if (kind != ".ply" && kind != ".spz" && kind != ".glb") {
    throw std::runtime_error("--out is " + options.out + ", but must end with .ply, .spz or .glb.");
  }
  make_folder_of(options.out);
  require_writable(options.out);
  const maquette::Context context = open_context();
  const maquette::Scene scene(context, options.scene);
  scene.save(options.out);
  print_output("%s: %" PRIu64 " splats\n", options.out.c_str(), scene.info().point_count);
  return 0;
}

}  // namespace

nlohmann::ordered_json describe_scene(const maq_scene_info& info, uint64_t file_bytes) {
  nlohmann::ordered_json document;
  document["points"] = info.point_count;
  document["view_dependent_points"] = info.view_dependent_count;
  document["blocks"] = info.block_count;
  document["bytes"] = file_bytes;
  document["coefficient_bits"] = info.coefficient_bits;
  document["up"] = info.up;
  document["bounds_min"] = info.bounds_min;
  document["bounds_max"] = info.bounds_max;
  return document;
}

void add_scene_command(CLI::App& app, int* exit_code) {
  CLI::App* scene = app.add_subcommand("scene", "Build a scene from photos, and render it from new viewpoints");
  scene->require_subcommand(1);
  scene->footer(
      "From a folder with photos, cameras and a point cloud (COLMAP, or transforms.json with a PLY file) to a clip:\n\n"
      "  maquette scene build my-room --out my-room.maqs\n"
      "  maquette scene render my-room.maqs --capture my-room --path through --out clip.mp4\n\n"
      "From a film or plain photos, by the Python package:\n\n"
      "  pip install 'maquette[scenes]'\n"
      "  python -m maquette scene make film.mp4 --out place.maqs");
  auto making = std::make_shared<MakeOptions>();
  CLI::App* make = scene->add_subcommand("make", "Make a scene of a film or photos (Python package only)");
  make->add_option("source", making->source, "A film, or a folder with photos")->required();
  make->add_option("-o,--out", making->out, "File of the scene: place.maqs")->required();
  make->add_option("--photos", making->photos, "Photos or frames of the film that are used at most (default 50)");
  make->add_option("--threads", making->threads, "Threads; default: all cores");
  make->callback([=] { tell_about_python(*making); });
  add_scene_build_command(*scene, exit_code);
  add_scene_render_command(*scene, exit_code);
  auto options = std::make_shared<InfoOptions>();
  CLI::App* command = scene->add_subcommand("info", "Check a scene file and print its content");
  command->add_option("scene", options->scene, "A file made by `maquette scene build`, or splats (.ply, .spz)")
      ->required();
  command->add_option("--json", options->json, "Also write this information to this file");
  command->callback([=] { *exit_code = show(*options); });
  auto exporting = std::make_shared<ExportOptions>();
  CLI::App* to_splats = scene->add_subcommand("export", "Write a scene as 3D Gaussians (splats) for other programs");
  to_splats->add_option("scene", exporting->scene, "A file made by `maquette scene build`, or splats (.ply, .spz)")
      ->required();
  to_splats
      ->add_option("-o,--out", exporting->out,
                   "File of the splats: .ply (3D Gaussian Splatting), .spz (version 3), or .glb "
                   "(KHR_gaussian_splatting)")
      ->required();
  to_splats->callback([=] { *exit_code = export_splats(*exporting); });
}
