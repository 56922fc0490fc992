// maquette-demo: a person's own body surface, live from a webcam; scenes; edges of a depth camera; heads; what comes
// predicted frames.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "app.h"

namespace fs = std::filesystem;

namespace {

// Beside the program, where the build and an installation have it; or what the environment says.
std::string shared_file(const char* variable, const char* path) {
  const char* const given = std::getenv(variable);
  if (given != nullptr && *given != '\0') return given;
  return (fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "share/maquette" / path).string();
}

}  // namespace

int main(int argc, char** argv) try {
  Options options;
  options.bundle = shared_file("MAQ_BUNDLE", "models/densepose-b-int8");
  options.scene_bundle = shared_file("MAQ_SCENE_BUNDLE", "models/scenes-int8");
  options.heads_bundle = shared_file("MAQ_HEADS_BUNDLE", "models/heads-int8");
  options.edges_bundle = shared_file("MAQ_EDGES_BUNDLE", "models/edges-int8");
  options.prediction.bundle = shared_file("MAQ_PREDICTION_BUNDLE", "models/prediction-int8");
  options.texture = shared_file("MAQ_DEMO_OUTFIT", "demo/outfit.png");
  if (!fs::exists(options.texture)) options.texture.clear();
  options.out = fs::current_path().string();
  bool part_only = false, skip_planes = false;
  double ahead_ms = options.prediction.ahead_s * 1e3;
  std::string method = kMethodNames[0];
  std::string path, view = "parts", compare = "none", layer = "depth", shading = "colour", size = "1280x800";

  CLI::App cli(
      "Shows the body surface of the people in front of a camera, live, on the CPU. Other views fly through scenes,\n"
      "show sharp edges in depth, make 3D heads, predict frames, and check the camera.\n\n"
      "  maquette-demo                       the first camera that works; without one, rendered people\n"
      "  maquette-demo clip.mp4              a photo, a clip, a recording, a scene (.maqs, .ply, .spz) or a capture's "
      "folder\n"
      "  maquette-demo --source 'stub:people?unplug=3s@5s'     any source of the SDK: see `maquette sources`\n"
      "  maquette-demo room.maqs --capture room --compare slider\n"
      "  maquette-demo photo.jpg --head      a 3D head of the person in a photo, or in the first image of a camera\n"
      "  maquette-demo --edges               edges and sizes of solids; or of a depth camera, a recording, an image:\n"
      "  maquette-demo --edges 'image:depth.png?depth_unit=0.001&fov=60'\n"
      "  maquette-demo --predict             now, and the predicted frame 200 ms later (--ahead)\n"
      "  maquette-demo --predict --conceal 'stub:people?stall=300ms@3s'\n"
      "                                      predicted frames, marked in magenta, while the camera stalls\n"
      "  maquette-demo --predict --health    also camera health: cuts, freezes, black, covered, moved\n"
      "  xvfb-run -a maquette-demo clip.mp4 --view contours --headless --frames 30 --screenshot out.png\n\n"
      "In the window F1 shows the keys. Files can be dropped on it.",
      "maquette-demo");
  cli.add_option("PATH", path, "A photo, clip, recording, scene file or capture folder");
  auto* const source = cli.add_option("--source", options.source, "A source by its URI")->excludes("PATH");
  cli.add_flag(
      "--edges", options.edges,
      "Show sharp edges of a depth camera, a recording or a depth image; default: " + std::string(kRenderedSolids));
  cli.add_option("--layer", layer, "Edges: image below the curves")
      ->capture_default_str()
      ->check(CLI::IsMember(maquette::kEdgeLayerNames));
  cli.add_flag("--curves,!--no-curves", options.edges_model.finds_curves, "Edges: find curves, corners and boxes");
  cli.add_flag("--boxes,!--no-boxes", options.edges_model.finds_boxes, "Edges: measure boxes");
  cli.add_flag("--skip-planes", skip_planes, "Edges: skip the network where depth is flat; faster");
  cli.add_flag("--head", options.head, "Make a 3D head of the person in the first image; the key G makes one later")
      ->excludes("--edges");
  cli.add_option("--shading", shading, "Heads: meaning of the colours")
      ->capture_default_str()
      ->check(CLI::IsMember(kShadingNames));
  cli.add_option("--fit-seconds", options.fit_seconds, "Heads: time for the fit to the pixels")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 3600.0));
  auto* const predict = cli.add_flag("--predict", options.predict, "Show the source and its predicted frame")
                            ->excludes("--edges")
                            ->excludes("--head");
  cli.add_option("--ahead", ahead_ms, "Time ahead, in milliseconds")
      ->capture_default_str()
      ->needs(predict)
      ->check(CLI::Range(kMinAheadMs, kMaxAheadMs));
  cli.add_option("--method", method, "Method of prediction. auto: last and motion, blended by their past errors")
      ->capture_default_str()
      ->needs(predict)
      ->check(CLI::IsMember(kMethodNames));
  cli.add_flag("--conceal", options.prediction.conceals_gaps,
               "Fill gaps of at most 300 ms with predicted frames, which are marked")
      ->needs(predict);
  cli.add_flag("--health", options.prediction.checks_camera, "Show camera health: map, curve and events")
      ->needs(predict);
  cli.add_flag("--entropy", options.prediction.shows_entropy, "Show uncertain cells of the predicted frame in red")
      ->needs(predict);
  cli.add_flag("--sample", options.prediction.shows_sample, "Also show one sampled future")->needs(predict);
  cli.add_option("--prediction-bundle", options.prediction.bundle, "Folder of the networks for entropy and samples");
  cli.add_option("--view", view, "View at the start")->capture_default_str()->check(CLI::IsMember(kViewNames));
  cli.add_flag("--mesh,!--no-mesh", options.mesh, "Show the template body in the corner");
  cli.add_flag("--person-colours,!--no-person-colours", options.person_colours,
               "Show the body in the colours of the person, more with each frame; otherwise by visible part");
  cli.add_option("--texture", options.texture, "Outfit of the try-on view: a DensePose atlas (2:3), or any image")
      ->check(CLI::ExistingFile);
  cli.add_option("--capture", options.capture, "Folder of the photos that the scene file was made of")
      ->check(CLI::ExistingDirectory);
  cli.add_option("--compare", compare, "Compare photo and rendering; heads: slider only")
      ->capture_default_str()
      ->check(CLI::IsMember(kCompareNames));
  cli.add_option("--bundle", options.bundle, "Folder of the dense pose networks");
  cli.add_option("--scene-bundle", options.scene_bundle, "Folder of the scene networks");
  cli.add_option("--edges-bundle", options.edges_bundle, "Folder of the edge network");
  cli.add_option("--heads-bundle", options.heads_bundle, "Folder of the heads' network");
  cli.add_option("--threads", options.model.model.threads, "Threads of the networks; 0: the large cores, at most 4")
      ->check(CLI::Range(0, 64));
  cli.add_option("--key-frames", options.model.key_frame_interval, "Detect people in every N-th frame")
      ->check(CLI::Range(1, 1000));
  cli.add_option("--frame-budget", options.live.frame_budget_ms,
                 "Time in milliseconds that the networks may take for a frame; they then do less work")
      ->check(CLI::Range(0.0, 60000.0));
  cli.add_flag("--part-only", part_only, "Compute only body parts: faster; U and V stay 0");
  cli.add_option("--size", size, "Size of the window")->capture_default_str();
  cli.add_option("--out", options.out, "Folder of snapshots, clips and recordings; default: the current folder")
      ->check(CLI::ExistingDirectory);
  auto* const headless = cli.add_flag("--headless", options.headless, "No visible window; ends with a line of JSON");
  cli.add_option("--frames", options.frames, "End after N frames")
      ->capture_default_str()
      ->needs(headless)
      ->check(CLI::Range(1, 1000000));
  cli.add_option("--pointer", options.pointer_px,
                 "Position of the pointer, as X,Y in pixels of the depth image (edges)")
      ->expected(2)
      ->delimiter(',')
      ->needs(headless);
  cli.add_option("--screenshot", options.screenshot, "PNG of the window at the end")->needs(headless);
  CLI11_PARSE(cli, argc, argv);

  options.view = View(std::find(kViewNames.begin(), kViewNames.end(), view) - kViewNames.begin());
  const auto& layers = maquette::kEdgeLayerNames;
  options.layer = maquette::EdgeLayer(std::find(layers.begin(), layers.end(), layer) - layers.begin());
  options.shading =
      maq_head_shading(std::find(kShadingNames.begin(), kShadingNames.end(), shading) - kShadingNames.begin());
  options.prediction.ahead_s = ahead_ms / 1e3;
  options.prediction.method =
      maq_predictor_method(std::find(kMethodNames.begin(), kMethodNames.end(), method) - kMethodNames.begin());
  options.compare = Compare(std::find(kCompareNames.begin(), kCompareNames.end(), compare) - kCompareNames.begin());
  const bool is_size = std::sscanf(size.c_str(), "%dx%d", &options.width_px, &options.height_px) == 2;
  if (!is_size || std::min(options.width_px, options.height_px) < 64 ||
      std::max(options.width_px, options.height_px) > 16384) {
    throw std::runtime_error("--size " + size + " is no size of a window: write it as 1280x800, each 64 to 16384.");
  }
  options.model.model.bundle_path = options.bundle.c_str();
  options.edges_model.edges.model.bundle_path = options.edges_bundle.c_str();
  options.edges_model.edges.model.threads = options.model.model.threads;
  options.edges_model.edges.skip_planes = skip_planes ? 1 : 0;
  options.model.detail = part_only ? MAQ_DENSEPOSE_DETAIL_PART : MAQ_DENSEPOSE_DETAIL_SURFACE;
  if (options.headless) {
    options.live.real_time = options.prediction.conceals_gaps;  // others have no gaps
    options.live.max_results = options.frames;
    options.live.reconnect_ms = 4000;
  }
  if (options.edges && source->empty()) options.source = kRenderedSolids;
  if (!path.empty()) options.source = path;
  return App(options).run();
} catch (const std::exception& error) {
  std::fprintf(stderr, "maquette-demo: %s\n", error.what());
  return 1;
}
