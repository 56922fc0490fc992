#include <CLI/CLI.hpp>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "arguments/model_options.h"
#include "commands/commands.h"
#include "commands/edges_commands.h"
#include "commands/source_frames.h"
#include "output/clip_file.h"
#include "output/edge_overlay.h"
#include "output/frame_image.h"
#include "output/output_file.h"
#include "output/prediction_mark.h"
#include "print.h"
#include "program.h"

namespace fs = std::filesystem;

namespace {

struct EdgesOptions {
  std::vector<std::string> sources;
  NetworkOptions network;
  std::string out;
  std::vector<std::string> formats;
  bool boxes = false;
  bool overlay = false;
  bool json = false;
  bool skip_planes = false;
  int average = 0;
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

// Of a frame, as far as they were asked for.
struct FoundCurves {
  std::optional<maquette::EdgesCurves> all;
  std::vector<maq_edges_curve> curves;
  std::vector<maq_edges_corner> corners;
  std::vector<maq_edges_box> boxes;
};

FoundCurves find_curves(const EdgesOptions& options, const maquette::EdgesResult& result) {
  FoundCurves found;
  if (options.formats.empty() && !options.boxes && !options.overlay) return found;
  maq_edges_curves_config config = maquette::default_edges_curves_config();
  config.find_boxes = options.boxes ? 1 : 0;
  found.all = result.find_curves(config);
  found.curves = found.all->curves();
  found.corners = found.all->corners();
  found.boxes = found.all->boxes();
  return found;
}

nlohmann::ordered_json describe(const maq_edges_box& box) {
  return {{"size_m", box.size_m}, {"plus_minus_m", box.plus_minus_m}, {"corners", box.corner_count}};
}

std::string text_of(const maq_edges_box& box) {
  std::string text;
  for (size_t i = 0; i < 3; ++i) {
    char side[64];
    std::snprintf(side, sizeof side, "%s%.0f +- %.0f", i == 0 ? "" : " x ", 1e3 * box.size_m[i],
                  1e3 * box.plus_minus_m[i]);
    text += side;
  }
  return text + " mm";
}

void print_frame(const EdgesOptions& options, const std::string& stem, const maq_frame_desc& desc,
                 const maquette::EdgesResult& result, const FoundCurves& found) {
  const maq_edges_stats stats = result.stats();
  if (!options.json) {
    const int64_t pixels = int64_t(result.width_px()) * result.height_px();
    print_output("%s  %d x %d  depth of %.0f %%  %.1f ms", stem.c_str(), result.width_px(), result.height_px(),
                 percent(stats.known_pixel_count, pixels), double(stats.total_ms));
    if (found.all) {
      print_output("  %zu curves, %zu corners in %.1f ms", found.curves.size(), found.corners.size(),
                   double(found.all->stats().curves_ms));
    }
    print_output("\n");
    for (const maq_edges_box& box : found.boxes) print_output("  box of %s\n", text_of(box).c_str());
    if (options.boxes && found.boxes.empty()) print_output("  no box\n");
    return;
  }
  nlohmann::ordered_json line = {{"frame", stem},
                                 {"timestamp_ns", desc.timestamp_ns},
                                 {"size", {result.width_px(), result.height_px()}},
                                 {"known_pixels", stats.known_pixel_count},
                                 {"network_pixels", stats.network_pixel_count},
                                 {"broken_pixels", stats.broken_pixel_count},
                                 {"averaged_pixels", stats.averaged_pixel_count},
                                 {"provider", name_of(stats.provider)},
                                 {"threads", stats.threads},
                                 {"threads_measured", stats.is_threads_measured != 0},
                                 {"ms",
                                  {{"depth", rounded_ms(double(stats.depth_ms))},
                                   {"skip", rounded_ms(double(stats.skip_ms))},
                                   {"slopes", rounded_ms(double(stats.slopes_ms))},
                                   {"network", rounded_ms(double(stats.network_ms))},
                                   {"decode", rounded_ms(double(stats.decode_ms))},
                                   {"total", rounded_ms(double(stats.total_ms))}}}};
  if (found.all) {
    line["curves"] = found.curves.size();
    line["corners"] = found.corners.size();
    line["ms"]["curves"] = rounded_ms(double(found.all->stats().curves_ms));
  }
  if (options.boxes) {
    line["boxes"] = nlohmann::ordered_json::array();
    for (const maq_edges_box& box : found.boxes) line["boxes"].push_back(describe(box));
    line["ms"]["boxes"] = rounded_ms(double(found.all->stats().boxes_ms));
  }
  print_output("%s\n", json_text(line).c_str());
  flush_output();  // for who reads line by line
}

// Runs one source to its end and writes its files.
void run_source(const EdgesOptions& options, const SourceArgument& argument, const maquette::Context& context,
                maquette::Source& source, maquette::Edges& edges) {
  const maq_intrinsics intrinsics = intrinsics_of(argument, source);
  const bool of_clip = is_clip(source);
  ClipFile clip(context, fs::path(options.out) / (argument.stem + "_overlay"),
                source.info().fps / double(options.limits.every));
  const bool prints = !of_clip || options.json || options.boxes;
  const auto work = [&](const SourceFrame& given) {
    const maquette::EdgesResult result = edges.run(given.frame, intrinsics);
    // Drawn before the first file is written, so that a frame has all its files or none.
    const FoundCurves found = find_curves(options, result);
    cv::Mat overlay = options.overlay ? draw_edge_overlay(result, found.curves, found.corners, found.boxes) : cv::Mat();
    if (options.overlay) draw_prediction_mark(given.frame, overlay);
    make_folder_of(fs::path(options.out) / (given.stem + "_distance.png"));
    result.save(options.out, given.stem);
    for (const std::string& format : options.formats) {
      found.all->save((fs::path(options.out) / (given.stem + "_curves." + format)).string());
    }
    if (options.overlay && of_clip) clip.add(overlay);
    if (options.overlay && !of_clip) {
      frame_of(context, overlay).save((fs::path(options.out) / (given.stem + "_overlay.png")).string());
    }
    if (prints) print_frame(options, given.stem, given.frame.desc(), result, found);
    return std::to_string(int(result.stats().total_ms + 0.5f)) + " ms";
  };
  const int64_t done = run_frames(argument, source, options.limits, prints, work);
  const fs::path overlay_path = clip.finish();
  if (!overlay_path.empty() && !options.json) {
    print_output("%s  %lld frames -> %s\n", argument.stem.c_str(), (long long)done, overlay_path.c_str());
  } else if (of_clip && !options.json) {
    print_output("%s  %lld frames\n", argument.stem.c_str(), (long long)done);
  }
}

int run_edges(const EdgesOptions& options) {
  const std::vector<SourceArgument> arguments = parse_sources(options.sources);
  const std::string bundle = edges_bundle_or_default(options.network.bundle);
  const maquette::Context context = open_context();
  std::unique_ptr<maquette::Edges> edges;
  const auto load = [&] {
    maq_edges_config config = maquette::default_edges_config();
    config.bundle_path = bundle.c_str();
    config.threads = options.network.threads;
    config.allow_spinning = options.network.no_spin ? 0 : 1;
    config.skip_planes = options.skip_planes ? 1 : 0;
    config.average_frames = options.average;
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
  CLI::App* command =
      app.add_subcommand("edges", "Find sharp edges in frames of a depth camera: their curves, and the sizes of boxes");
  CLI::Option* const source = command->add_option(
      "source", options->sources,
      "Depth pictures, recordings, cameras or stubs: 'image:depth.png?depth_unit=0.001&fov=60' (see "
      "`maquette sources`)");
  CLI::Option* const out = command->add_option("-o,--out", options->out, "Folder for the results; created if needed");
  command->add_flag("--overlay", options->overlay,
                    "Also draw curves and corners over the depth in colours: <stem>_overlay.png, for clips "
                    "<stem>_overlay.mp4");
  command
      ->add_option("--format", options->formats,
                   "Also write the curves: json, obj, ply, dxf or step, or several (json,dxf)")
      ->delimiter(',')
      ->check(CLI::IsMember({"json", "obj", "ply", "dxf", "step"}));
  command->add_flag("--boxes", options->boxes, "Also measure boxes: print their sizes, and draw them with --overlay");
  command->add_flag("--json", options->json, "Print counts and times as one JSON line per frame");
  add_network_options(*command, options->network, "MAQ_EDGES_BUNDLE");
  command->add_flag(
      "--skip-planes", options->skip_planes,
      "Run the network only where a plane does not explain the depth: faster, may miss flat creases in noise");
  command
      ->add_option("--average", options->average,
                   "Take the mean of so many frames where nothing moves, 2 to 64: of a camera at rest, less noise")
      ->check(CLI::Range(2, 64));
  add_frame_limits(*command, options->limits);
  command->footer(
      "Writes for each frame:\n"
      "  <stem>_distance.png   16 bits: distance to the nearest sharp edge in thousandths of r, at most 16 r\n"
      "  <stem>_kind.png       8 bits: 1 where that edge is a crease (both its sides are seen), 2 where it is a\n"
      "                        boundary (one side is hidden), 0 where none is within 16 r or depth is unknown\n"
      "  <stem>_edges.json     size, intrinsics and units\n"
      "  <stem>_curves.<format>  lines, arcs and splines in metres, of the formats that --format names: step and dxf\n"
      "                        for CAD programs, obj and ply for viewers, json for programs of your own\n"
      "r is the distance of neighbouring pixels on a surface that faces the camera: depth / focal length, 3 mm at a\n"
      "metre with 333 px. Frames of a clip are named <stem>_<frame number>. Files are written atomically.\n\n"
      "An overlay shows convex creases yellow, concave ones green, boundaries white, corners red, and boxes with "
      "their\n"
      "lengths in millimetres. A box is measured where of each of its three directions an edge is seen from corner to\n"
      "corner: look at it from above, with a corner towards the camera. +- is two standard deviations.\n\n"
      "Depth needs a unit and a calibration. Cameras and recordings bring both; pictures are told:\n"
      "  depth_unit=0.001      metres of a stored 1 in a 16-bit PNG or TIFF (1 for metres as floats in a TIFF)\n"
      "  fov=60                horizontal field of view in degrees, or fx=, fy=, cx=, cy= in pixels\n\n"
      "Examples:\n"
      "  maquette edges 'image:depth.png?depth_unit=0.001&fov=60' --out results --overlay --boxes\n"
      "  maquette edges 'image:scan.tiff?depth_unit=1&fx=570&fy=570' --out results --format step,dxf\n"
      "  maquette edges 'stub:solids?scene=shelf&noise=tof' --out results --overlay --max-frames 60\n"
      "  maquette edges rec:desk.maqrec --out results --boxes --json\n"
      "  maquette edges depthai: --out results --boxes --average 16 --max-frames 32\n"
#if MAQ_HAS_SCENES
      "  maquette edges build scan --out model.dxf\n"
#endif
      "  maquette edges info");
  command->require_subcommand(0, 1);
#if MAQ_HAS_SCENES  // captures
  add_edges_build_command(*command, exit_code);
#endif
  add_edges_info_command(*command, exit_code);
  command->callback([=] {
    if (!command->get_subcommands().empty()) return;
    for (const CLI::Option* needed : {source, out}) {
      if (needed->empty()) throw CLI::RequiredError(needed->get_name());
    }
    *exit_code = run_edges(*options);
  });
}
