#include <CLI/CLI.hpp>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "arguments/bundle_argument.h"
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
  double focal_tolerance_percent = 0;
  FrameLimits limits;
};

// The library's own error cannot repeat the URI.
void require_intrinsics(const SourceArgument& argument, const maquette::Source& source) {
  if (source.intrinsics()) return;
  const char* const more = argument.uri.find('?') == std::string::npos ? "?" : "&";
  throw std::runtime_error(argument.uri +
                           " has no calibration, which is needed for lengths. Add the horizontal field of view in "
                           "degrees, or the focal lengths in pixels: " +
                           argument.uri + more + "fov=60, " + argument.uri + more + "fx=380&fy=380.");
}

double percent(int64_t part, int64_t whole) { return 100.0 * double(part) / double(whole); }

// The curves of a frame, if an option needs them.
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
  config.skip_boxes = options.boxes ? 0 : 1;
  config.focal_tolerance = float(options.focal_tolerance_percent / 100);
  found.all = result.find_curves(config);
  found.curves = found.all->curves();
  found.corners = found.all->corners();
  found.boxes = found.all->boxes();
  return found;
}

nlohmann::ordered_json describe(const maq_edges_box& box) {
  return {{"size_m", box.size_m},
          {"size_tolerance_m", box.size_tolerance_m},
          {"includes_focal_tolerance", box.includes_focal_tolerance != 0},
          {"corners", box.corner_count}};
}

std::string text_of(const maq_edges_box& box) {
  std::string text;
  for (size_t i = 0; i < 3; ++i) {
    char side[64];
    std::snprintf(side, sizeof side, "%s%.0f +- %.0f", i == 0 ? "" : " x ", 1e3 * box.size_m[i],
                  1e3 * box.size_tolerance_m[i]);
    text += side;
  }
  return text + (box.includes_focal_tolerance != 0 ? " mm" : " mm if the focal length is exact");
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
                                 {"far_pixels", stats.far_pixel_count},
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
  flush_output();  // the reader may wait for each line
}

// Runs one source to its end and writes its files.
void run_source(const EdgesOptions& options, const SourceArgument& argument, const maquette::Context& context,
                maquette::Source& source, maquette::Edges& edges) {
  require_intrinsics(argument, source);
  const bool of_clip = is_clip(source);
  ClipFile clip(context, fs::u8path(options.out) / fs::u8path(argument.stem + "_overlay.mp4"),
                source.info().fps / double(options.limits.every));
  const bool prints = !of_clip || options.json || options.boxes;
  const auto work = [&](const SourceFrame& given) {
    const maquette::EdgesResult result = edges.run(given.frame);
    // The overlay is drawn before the first file is written, so that a frame has all its files or none.
    const FoundCurves found = find_curves(options, result);
    Canvas overlay = options.overlay ? draw_edge_overlay(result, found.curves, found.corners, found.boxes) : Canvas();
    if (options.overlay) draw_prediction_mark(given.frame, overlay);
    if (!options.out.empty()) {
      const fs::path path = fs::u8path(options.out) / fs::u8path(given.stem);
      make_folder_of(path);
      result.save(path.string());
      for (const std::string& format : options.formats) found.all->save(path.string() + "_curves." + format);
    }
    if (options.overlay && of_clip) clip.add(overlay);
    if (options.overlay && !of_clip) {
      frame_of(context, overlay).save((fs::u8path(options.out) / fs::u8path(given.stem + "_overlay.png")).string());
    }
    if (prints) print_frame(options, given.stem, given.frame.desc(), result, found);
    return std::to_string(int(result.stats().total_ms + 0.5f)) + " ms";
  };
  const int64_t done = run_frames(argument, source, options.limits, prints, work);
  const fs::path overlay_path = clip.finish();
  if (!overlay_path.empty() && !options.json) {
    print_output("%s  %lld frames -> %s\n", argument.stem.c_str(), (long long)done, overlay_path.string().c_str());
  } else if (of_clip && !options.json) {
    print_output("%s  %lld frames\n", argument.stem.c_str(), (long long)done);
  }
}

int run_edges(const EdgesOptions& options) {
  const std::vector<SourceArgument> arguments = parse_sources(options.sources);
  const std::string bundle = bundle_or_default(kEdgesNetworks, options.network.bundle);
  const maquette::Context context = open_context();
  std::unique_ptr<maquette::Edges> edges;
  const auto load = [&](const maquette::Source&) {
    if (edges != nullptr) return;
    maq_edges_config config = maquette::default_edges_config();
    config.model.bundle_path = bundle.c_str();
    config.model.threads = options.network.threads;
    config.skip_planes = options.skip_planes ? 1 : 0;
    config.average_frames = options.average;
    config.model.provider = provider_of(options.network);
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
      app.add_subcommand("edges", "Find sharp edges, their curves, and the sizes of boxes in depth frames");
  CLI::Option* const source =
      command->add_option("source", options->sources,
                          "Depth images, recordings, cameras or stubs: 'image:depth.png?depth_unit=0.001&fov=60' (see "
                          "`maquette sources`)");
  CLI::Option* const out = command->add_option(
      "-o,--out", options->out, "Folder for files, created if needed; without it, results are only printed");
  command
      ->add_flag("--overlay", options->overlay,
                 "Also draw curves and corners over the depth: <stem>_overlay.png, for clips <stem>_overlay.mp4")
      ->needs(out);
  command
      ->add_option("--format", options->formats,
                   "Also write the curves: json, obj, ply, dxf or step, or several (json,dxf)")
      ->delimiter(',')
      ->check(CLI::IsMember({"json", "obj", "ply", "dxf", "step"}))
      ->needs(out);
  command->add_flag("--boxes", options->boxes, "Also measure boxes: print their sizes, and draw them with --overlay");
  command
      ->add_option("--focal-tolerance", options->focal_tolerance_percent,
                   "Uncertainty of the focal length in percent (two standard deviations), for +- of boxes")
      ->check(CLI::Range(0.0, 50.0));
  command->add_flag("--json", options->json, "Print counts and times as one JSON line per frame");
  add_network_options(*command, options->network, "MAQ_EDGES_BUNDLE");
  command->add_flag("--skip-planes", options->skip_planes,
                    "Skip the network where depth is flat: faster, may miss flat creases in noise");
  command
      ->add_option("--average", options->average,
                   "Average depth over N frames, 2 to 64, to reduce noise; the camera must not move")
      ->check(CLI::Range(2, 64));
  add_frame_limits(*command, options->limits);
  command->footer(
      "With --out, each frame gives these files:\n"
      "  <stem>_distance.png   16 bits: distance to the nearest sharp edge in thousandths of r, at most 16 r\n"
      "  <stem>_kind.png       8 bits: kind of the nearest edge. 1: crease (both sides are visible), 2: boundary (one\n"
      "                        side is hidden), 0: no edge within 16 r, or depth is unknown\n"
      "  <stem>_edges.json     size, intrinsics and units\n"
      "  <stem>_curves.<format>  lines, arcs and splines in metres, one file for each --format: step and dxf for CAD\n"
      "                        programs, obj and ply for viewers, json for your own programs\n\n"
      "r is the distance between neighbouring pixels on a surface that faces the camera: depth / focal length. It is\n"
      "3 mm at one metre with a focal length of 333 px. Frames of a clip are named <stem>_<frame number>. Files are\n"
      "written atomically.\n\n"
      "An overlay shows convex creases yellow, concave creases green, boundaries white, corners red. Boxes have their\n"
      "lengths in millimetres. To measure a box, look at it from above, with a corner towards the camera. One edge in\n"
      "each of its three directions must be visible from corner to corner. +- is two standard deviations. It includes\n"
      "the error of the focal length with --focal-tolerance alone: 1 for 1 %.\n\n"
      "Depth needs a unit and a calibration. Cameras and recordings have both. For an image, add them to the URI:\n"
      "  depth_unit=0.001      metres of a stored 1 in a 16-bit PNG or TIFF (1 for metres as floats in a TIFF)\n"
      "  fov=60                horizontal field of view in degrees, or fx=, fy=, cx=, cy= in pixels\n\n"
      "Examples:\n"
      "  maquette edges 'image:depth.png?depth_unit=0.001&fov=60' --boxes\n"
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
    if (source->empty()) throw CLI::RequiredError(source->get_name());
    *exit_code = run_edges(*options);
  });
}
