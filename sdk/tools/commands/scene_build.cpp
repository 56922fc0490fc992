#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <map>
#include <maquette/maquette.hpp>
#include <memory>
#include <optional>
#include <stdexcept>

#include "arguments/bundle_argument.h"
#include "commands/scene_commands.h"
#include "interrupt.h"
#include "machine.h"
#include "output/output_file.h"
#include "output/progress_bar.h"
#include "print.h"
#include "program.h"

namespace {

struct BuildOptions {
  std::string capture;
  std::string out;
  std::string bundle;
  std::string ply;
  std::string json;
  int threads = 0;
  int long_side = 640;  // 0: photos are not scaled
  int coefficients = 0;
  std::optional<double> min_variation;
  double visibility_scale = 0;
  double near_depth = 0;
  uint64_t points = 0;
  uint32_t views = 0;
  bool all_photos = false;
  double splat_fit_s = 60;
  maq_scene_points points_from = MAQ_SCENE_POINTS_DEFAULT;
};

constexpr int kPermille = 1000;

int32_t show_progress(void* bar, double done, const char* what) {
  static_cast<ProgressBar*>(bar)->advance(int64_t(done * kPermille), what);
  return interrupted() ? 0 : 1;
}

maquette::Scene build_or_tell(const maquette::Context& context, const maq_scene_build_config& config,
                              const maquette::Capture& capture, const std::string& out) {
  try {
    return maquette::Scene(context, config, capture);
  } catch (const maquette::Error&) {
    if (!interrupted()) throw;
    throw std::runtime_error("Interrupted; " + out + " is as it was before.");
  }
}

int build(const BuildOptions& options) {
  catch_interrupts();
  const maquette::Context context = open_context();
  const maquette::Capture capture(context, options.capture);
  const maq_capture_info info = capture.info();
  print_error("%s: %u photos, %" PRIu64 " points\n", options.capture.c_str(), info.view_count, info.point_count);
  for (uint32_t i = 0; i < info.drop_count; ++i) {
    const maq_capture_drop drop = capture.drop(i);
    print_error("  left out: %" PRIu64 " %s\n", drop.count, drop.reason);
  }
  const std::string networks = bundle_or_default(kScenesNetworks, options.bundle);
  for (const std::string* path : {&options.out, &options.ply}) {
    make_folder_of(*path);
    require_writable(*path);
  }
  require_writable(options.json);
  ProgressBar progress("building", kPermille, ProgressBar::Shown::kPercent);
  maq_scene_build_config config = maquette::default_scene_build_config();
  config.model.bundle_path = networks.c_str();
  config.model.threads = options.threads;
  config.long_side_px = options.long_side == 0 ? MAQ_SCENE_LONG_SIDE_FULL : options.long_side;
  config.coefficient_bits = options.coefficients;
  if (options.min_variation) {
    config.min_variation = *options.min_variation == 0 ? MAQ_SCENE_VARIATION_ALL : *options.min_variation;
  }
  config.visibility_scale = options.visibility_scale;
  config.near_depth = options.near_depth;
  config.max_points = options.points;
  config.max_views = options.views;
  config.use_held_out = options.all_photos ? 1 : 0;
  config.points = options.points_from;
  const std::string kind = std::filesystem::u8path(options.out).extension().string();
  const bool makes_splats = kind == ".ply" || kind == ".spz" || kind == ".glb";
  config.splat_fit_s = makes_splats ? options.splat_fit_s : 0;
  if (makes_splats && !options.ply.empty()) {
    throw std::runtime_error("--ply is for scenes of points; " + options.out + " has splats.");
  }
  config.progress_callback = show_progress;
  config.progress_user_data = &progress;
  const maquette::Scene scene = build_or_tell(context, config, capture, options.out);
  const maq_scene_build_stats stats = scene.build_stats();
  progress.finish();
  const double before_saving_s = seconds_since_start();
  scene.save(options.out);
  if (!options.ply.empty()) scene.save_ply(options.ply);
  const double total_s = seconds_since_start();

  const maq_scene_info made = scene.info();
  std::error_code is_device;  // which has no size
  uint64_t bytes = std::filesystem::file_size(options.out, is_device);
  if (is_device) bytes = 0;
  print_output("%s: %" PRIu64 " of %" PRIu64 " points were seen by %u photos; %.1f MB, %.1f bytes a point; %.1f s\n",
               options.out.c_str(), made.point_count, stats.cloud_point_count, stats.view_count, double(bytes) / 1e6,
               double(bytes) / double(made.point_count), total_s);
  if (stats.depth_ms > 0) {
    print_output("  the points come from the depth of the photos, computed in %.1f s\n", stats.depth_ms / 1e3);
  }
  if (stats.unused_view_count > 0) {
    print_output("  %u photos could not be used: unreadable, missing, or they see no point\n", stats.unused_view_count);
  }
  if (!options.json.empty()) {
    nlohmann::ordered_json document = describe_scene(made, bytes);
    document["cloud_points"] = stats.cloud_point_count;
    document["views"] = stats.view_count;
    document["unused_views"] = stats.unused_view_count;
    document["seconds"] = {{"total", total_s},
                           {"depth", stats.depth_ms / 1e3},
                           {"load", stats.load_ms / 1e3},
                           {"visibility", stats.visibility_ms / 1e3},
                           {"align", stats.align_ms / 1e3},
                           {"extract", stats.extract_ms / 1e3},
                           {"accumulate", stats.accumulate_ms / 1e3},
                           {"solve", stats.solve_ms / 1e3},
                           {"pack", stats.pack_ms / 1e3},
                           {"save", total_s - before_saving_s}};
    document["peak_memory_mib"] = double(peak_memory_bytes()) / double(1 << 20);
    write_json_file(options.json, document, 2);
  }
  return 0;
}

}  // namespace

void add_scene_build_command(CLI::App& scene, int* exit_code) {
  auto options = std::make_shared<BuildOptions>();
  CLI::App* command = scene.add_subcommand(
      "build", "Build a scene from a folder with photos, cameras and a dense or sparse point cloud");
  command
      ->add_option("capture", options->capture,
                   "Folder with photos, a point cloud, and a COLMAP model or transforms.json")
      ->required();
  command
      ->add_option("-o,--out", options->out,
                   "File of the scene: room.maqs; or of splats: room.spz, room.ply, room.glb. Replaces an existing one")
      ->required();
  command
      ->add_option("--fit-seconds", options->splat_fit_s,
                   "Splats only: fit them to the photos for so many seconds (default 60)")
      ->check(CLI::Range(0.001, 86400.0));
  command->add_option(
      "--bundle", options->bundle,
      "Folder of the scene bundle; default: MAQ_SCENE_BUNDLE, then the one installed with this program");
  command->add_option("--points", options->points, "Maximum number of points; larger clouds are thinned out evenly")
      ->check(CLI::PositiveNumber);
  const std::map<std::string, maq_scene_points> sources = {{"cloud", MAQ_SCENE_POINTS_CLOUD},
                                                           {"depth", MAQ_SCENE_POINTS_DEPTH}};
  command
      ->add_option("--points-from", options->points_from,
                   "cloud: the points of the capture; depth: points that are computed from the photos. Default: depth "
                   "if the capture has only the sparse points of COLMAP or nerfstudio")
      ->transform(CLI::CheckedTransformer(sources));
  command->add_option("--views", options->views, "Maximum number of photos, selected evenly")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--long-side", options->long_side, "Scale larger photos down to this long side in pixels; 0: never")
      ->check(CLI::Range(0, 16384));
  command
      ->add_option("--coefficients", options->coefficients,
                   "Bits of each number of a descriptor: 8, 16 or 32 (default 8)")
      ->check(CLI::IsMember({8, 16, 32}));
  command
      ->add_option(
          "--min-variation", options->min_variation,
          "Store points that vary less between photos (RMS, colours of 0 to 1) without view dependence. Larger "
          "values make smaller files; with 0 all points are view-dependent.")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--visibility-scale", options->visibility_scale,
                   "Test visibility at this fraction of the photos' resolution; below 1 for sparse clouds")
      ->check(CLI::Range(1.0 / 16, 1.0));
  command
      ->add_option("--near", options->near_depth, "Ignore points nearer to a camera than this, in units of the scene")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--threads", options->threads, "Threads; default: the large cores, at most 4")
      ->check(CLI::Range(1, 64));
  command->add_flag("--all-photos", options->all_photos, "Also use the held-out photos of the capture");
  command->add_option("--ply", options->ply, "Also write the points with their colours to this PLY file");
  command->add_option("--json", options->json, "Write counts and times to this file");
  command->callback([=] { *exit_code = build(*options); });
}
