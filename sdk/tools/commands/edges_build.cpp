#include <CLI/CLI.hpp>
#include <algorithm>
#include <cinttypes>
#include <maquette/maquette.hpp>
#include <memory>
#include <stdexcept>

#include "arguments/bundle_argument.h"
#include "arguments/model_options.h"
#include "commands/edges_commands.h"
#include "interrupt.h"
#include "output/output_file.h"
#include "output/progress_bar.h"
#include "print.h"
#include "program.h"

namespace {

struct BuildOptions {
  std::string capture;
  std::string out;
  NetworkOptions network;
  int min_views = 2;
  double cell_m = 0;
};

constexpr int64_t kStepsOfView = 10, kStepsOfFusion = 100;

struct Progress {
  ProgressBar bar;
  int64_t before;  // steps
};

int32_t show_progress(void* progress, double done) {
  auto* const shown = static_cast<Progress*>(progress);
  shown->bar.advance(shown->before + int64_t(done * double(kStepsOfFusion)), "fusing");
  return interrupted() ? 0 : 1;
}

void fail_if_interrupted(const std::string& out) {
  if (interrupted()) throw std::runtime_error("Interrupted; " + out + " is as it was before.");
}

int build(const BuildOptions& options) {
  catch_interrupts();
  const std::string bundle = bundle_or_default(kEdgesNetworks, options.network.bundle);
  const maquette::Context context = open_context();
  const maquette::Capture capture(context, options.capture);
  const maq_capture_info info = capture.info();
  std::vector<uint32_t> views;
  for (uint32_t i = 0; i < info.view_count; ++i) {
    if (capture.view(i).has_depth == 1) views.push_back(i);
  }
  for (uint32_t i = 0; i < info.drop_count; ++i) {
    const maq_capture_drop drop = capture.drop(i);
    print_error("  left out: %" PRIu64 " %s\n", drop.count, drop.reason);
  }
  if (views.empty()) {
    throw std::runtime_error(options.capture +
                             " has no depth images, but edges need them. Add \"depth_file_path\" to each frame of its "
                             "transforms.json (16-bit PNG in millimetres, or TIFF in metres).");
  }
  print_error("%s: %zu of %u views have depth\n", options.capture.c_str(), views.size(), info.view_count);
  make_folder_of(options.out);
  require_writable(options.out);

  const int64_t of_views = kStepsOfView * int64_t(views.size());
  Progress progress{ProgressBar("building", of_views + kStepsOfFusion, ProgressBar::Shown::kPercent), of_views};
  maq_edges_config of_edges = maquette::default_edges_config();
  of_edges.model.bundle_path = bundle.c_str();
  of_edges.model.threads = options.network.threads;
  of_edges.model.provider = provider_of(options.network);
  maquette::Edges edges(context, of_edges);
  maq_edges_fusion_config config = maquette::default_edges_fusion_config();
  config.threads = std::max(0, options.network.threads);  // the fusion cannot measure threads
  config.cell_m = options.cell_m;
  config.min_views = options.min_views;
  config.progress_callback = show_progress;
  config.progress_user_data = &progress;
  maquette::EdgesFusion fusion(context, config);
  for (size_t i = 0; i < views.size(); ++i) {
    fail_if_interrupted(options.out);
    progress.bar.advance(kStepsOfView * int64_t(i), capture.view(views[i]).name);
    const auto [depth, camera] = capture.load_depth(views[i]);
    fusion.add_view(edges.run(depth), camera);
  }
  try {
    fusion.finish();
  } catch (const maquette::Error&) {
    fail_if_interrupted(options.out);
    throw;
  }
  progress.bar.finish();
  const maquette::EdgesCurves curves = fusion.find_curves();
  curves.save(options.out);
  const maq_edges_fusion_info made = fusion.info();
  double length_m = 0;
  for (const maq_edges_curve& curve : curves.curves()) length_m += curve.length_m;
  print_output("%s: %zu curves, %.2f m long, %zu corners of %u views and %" PRIu64 " points; fused in %.0f ms\n",
               options.out.c_str(), curves.curves().size(), length_m, curves.corners().size(), made.view_count,
               made.point_count, double(made.fusion_ms));
  return 0;
}

}  // namespace

void add_edges_build_command(CLI::App& edges, int* exit_code) {
  auto options = std::make_shared<BuildOptions>();
  CLI::App* command =
      edges.add_subcommand("build", "Find the sharp edges of an object or a room in depth images with known cameras");
  command
      ->add_option("capture", options->capture,
                   "Folder with a transforms.json that names a depth image for each frame (\"depth_file_path\")")
      ->required();
  command
      ->add_option("-o,--out", options->out,
                   "File of the curves: .json, .obj, .ply, .dxf or .step; replaces an existing one")
      ->required();
  command
      ->add_option("--min-views", options->min_views,
                   "Drop curves that fewer views have seen (default 2; 1: drop none)")
      ->check(CLI::Range(1, 1000));
  command
      ->add_option("--cell", options->cell_m,
                   "Distance between fused points in metres; default: the footprint of the median pixel")
      ->check(CLI::PositiveNumber);
  add_network_options(*command, options->network, "MAQ_EDGES_BUNDLE");
  command->footer(
      "Curves are in world coordinates of the cameras, in metres. An edge that one view hides may be visible in\n"
      "another. With three or more views, an edge that only one view shows is dropped.\n\n"
      "Examples:\n"
      "  maquette edges build scan --out model.dxf\n"
      "  maquette edges build scan --out model.step --min-views 3");
  command->callback([=] { *exit_code = build(*options); });
}
