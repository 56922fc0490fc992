#include <CLI/CLI.hpp>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "arguments/bundle_argument.h"
#include "arguments/model_options.h"
#include "commands/commands.h"
#include "commands/source_frames.h"
#include "output/clip_file.h"
#include "output/edge_overlay.h"
#include "output/frame_image.h"
#include "output/output_file.h"
#include "print.h"
#include "program.h"

namespace fs = std::filesystem;

namespace {

struct EdgesOptions {
  std::vector<std::string> sources;
  NetworkOptions network;
  std::string out;
  bool overlay = false;
  bool json = false;
  bool skip_planes = false;
  FrameLimits limits;
};

maq_intrinsics intrinsics_of(const SourceArgument& argument, const maquette::Source& source) {
  const auto found = source.intrinsics();
  if (!found) {
    const char* const more = argument.uri.find('?') == std::string::npos ? "?" : "&";
    throw std::runtime_error(argument.uri +
                             " does not say how the camera maps directions to pixels, from which lengths come; add the "
                             "horizontal field of view in degrees, or focal lengths in pixels: " +
                             argument.uri + more + "fov=60, " + argument.uri + more + "fx=380&fy=380.");
  }
  return *found;
}

double percent(int64_t part, int64_t whole) { return 100.0 * double(part) / double(whole); }

void print_frame(const EdgesOptions& options, const std::string& stem, const maq_frame_desc& desc,
                 const maquette::EdgesResult& result) {
  const maq_edges_stats stats = result.stats();
  const int64_t pixels = int64_t(result.width_px()) * result.height_px();
  if (options.json) {
    const nlohmann::ordered_json line = {{"frame", stem},
                                         {"timestamp_ns", desc.timestamp_ns},
                                         {"size", {result.width_px(), result.height_px()}},
                                         {"known_pixels", stats.known_pixel_count},
                                         {"network_pixels", stats.network_pixel_count},
                                         {"broken_pixels", stats.broken_pixel_count},
                                         {"provider", name_of(stats.provider)},
                                         {"ms",
                                          {{"depth", rounded_ms(double(stats.depth_ms))},
                                           {"skip", rounded_ms(double(stats.skip_ms))},
                                           {"slopes", rounded_ms(double(stats.slopes_ms))},
                                           {"network", rounded_ms(double(stats.network_ms))},
                                           {"decode", rounded_ms(double(stats.decode_ms))},
                                           {"total", rounded_ms(double(stats.total_ms))}}}};
    print_output("%s\n", json_text(line).c_str());
    flush_output();  // for who reads line by line
  } else {
    print_output("%s  %d x %d  depth of %.0f %%  %.1f ms\n", stem.c_str(), result.width_px(), result.height_px(),
                 percent(stats.known_pixel_count, pixels), double(stats.total_ms));
  }
}

// Runs one source to its end and writes its files.
void run_source(const EdgesOptions& options, const SourceArgument& argument, const maquette::Context& context,
                maquette::Source& source, maquette::Edges& edges) {
  const maq_intrinsics intrinsics = intrinsics_of(argument, source);
  const bool of_clip = is_clip(source);
  ClipFile clip(context, fs::path(options.out) / (argument.stem + "_overlay"),
                source.info().fps / double(options.limits.every));
  const auto work = [&](const SourceFrame& given) {
    const maquette::EdgesResult result = edges.run(given.frame, intrinsics);
    // Drawn before the first file is written, so that a frame has all its files or none.
    const cv::Mat overlay = options.overlay ? draw_edge_overlay(result) : cv::Mat();
    make_folder_of(fs::path(options.out) / (given.stem + "_distance.png"));
    result.save(options.out, given.stem);
    if (options.overlay && of_clip) clip.add(overlay);
    if (options.overlay && !of_clip) {
      frame_of(context, overlay).save((fs::path(options.out) / (given.stem + "_overlay.png")).string());
    }
    if (!of_clip || options.json) print_frame(options, given.stem, given.frame.desc(), result);
    return std::to_string(int(result.stats().total_ms + 0.5f)) + " ms";
  };
  const int64_t done = run_frames(argument, source, options.limits, options.json, work);
  const fs::path overlay_path = clip.finish();
  if (!overlay_path.empty() && !options.json) {
    print_output("%s  %lld frames -> %s\n", argument.stem.c_str(), (long long)done, overlay_path.c_str());
  } else if (of_clip && !options.json) {
    print_output("%s  %lld frames\n", argument.stem.c_str(), (long long)done);
  }
}

int run_edges(const EdgesOptions& options) {
  const std::vector<SourceArgument> arguments = parse_sources(options.sources);
  const std::string bundle = options.network.bundle.empty() ? default_edges_bundle() : options.network.bundle;
  if (bundle.empty()) {
    throw std::runtime_error(
        "No bundle of the edge network was found; name its folder with --bundle or "
        "MAQ_EDGES_BUNDLE.");
  }
  const maquette::Context context = open_context();
  std::unique_ptr<maquette::Edges> edges;
  const auto load = [&] {
    maq_edges_config config = maquette::default_edges_config();
    config.bundle_path = bundle.c_str();
    config.threads = options.network.threads;
    config.allow_spinning = options.network.no_spin ? 0 : 1;
    config.skip_planes = options.skip_planes ? 1 : 0;
    config.provider = provider_of(options.network);
    edges = std::make_unique<maquette::Edges>(context, config);
  };
  const auto run = [&](const SourceArgument& argument, maquette::Source& source) {
    run_source(options, argument, context, source, *edges);
  };
  return run_sources(context, arguments, load, run);
}

}  // namespace

void add_edges_command(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<EdgesOptions>();
  CLI::App* command = app.add_subcommand(
      "edges", "Find the sharp edges in frames of a depth camera, and how far each point is from them");
  command
      ->add_option("source", options->sources,
                   "Depth pictures, recordings, cameras or stubs: 'image:depth.png?depth_unit=0.001&fov=60' (see "
                   "`maquette sources`)")
      ->required();
  command->add_option("-o,--out", options->out, "Folder for the results; created if needed")->required();
  command->add_flag(
      "--overlay", options->overlay,
      "Also draw depth in colours with creases in yellow and boundaries in white: <stem>_overlay.png, for "
      "clips <stem>_overlay.mp4");
  command->add_flag("--json", options->json, "Print counts and times as one JSON line per frame");
  add_network_options(*command, options->network, "MAQ_EDGES_BUNDLE");
  command->add_flag(
      "--skip-planes", options->skip_planes,
      "Run the network only where a plane does not explain the depth: faster, may miss flat creases in noise");
  add_frame_limits(*command, options->limits);
  command->footer(
      "Writes for each frame:\n"
      "  <stem>_distance.png  16 bits: distance to the nearest sharp edge in thousandths of r, at most 16 r\n"
      "  <stem>_kind.png      8 bits: 1 where that edge is a crease (both its sides are seen), 2 where it is a\n"
      "                       boundary (one side is hidden), 0 where none is within 16 r or depth is unknown\n"
      "  <stem>_edges.json    size, intrinsics and units\n"
      "r is the distance of neighbouring pixels on a surface that faces the camera: depth / focal length, 3 mm at a\n"
      "metre with 333 px. Frames of a clip are named <stem>_<frame number>. Files are written atomically.\n\n"
      "Depth needs a unit and a calibration. Cameras and recordings bring both; pictures are told:\n"
      "  depth_unit=0.001     metres of a stored 1 in a 16-bit PNG or TIFF (1 for metres as floats in a TIFF)\n"
      "  fov=60               horizontal field of view in degrees, or fx=, fy=, cx=, cy= in pixels\n\n"
      "Examples:\n"
      "  maquette edges 'image:depth.png?depth_unit=0.001&fov=60' --out results --overlay\n"
      "  maquette edges 'image:scan.tiff?depth_unit=1&fx=570&fy=570' --out results --json\n"
      "  maquette edges 'stub:solids?scene=shelf&noise=tof' --out results --overlay --max-frames 60\n"
      "  maquette edges rec:desk.maqrec --out results --overlay");
  command->callback([=] { *exit_code = run_edges(*options); });
}
