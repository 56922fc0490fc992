#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>

#include "arguments/bundle_argument.h"
#include "arguments/picture_size.h"
#include "commands/scene_commands.h"
#include "commands/scene_flight.h"
#include "interrupt.h"
#include "output/frame_image.h"
#include "output/output_file.h"
#include "output/progress_bar.h"
#include "print.h"
#include "program.h"

namespace fs = std::filesystem;

namespace {

struct RenderOptions {
  std::string scene;
  std::string out;
  std::string bundle;
  std::string capture;
  std::string views;
  std::string path;
  std::string size;
  std::string json;
  double seconds = 6;
  double fps = 25;
  double near_depth = 0;
  int threads = 0;
  int repeat = 1;
  bool no_alpha = false;
  bool is_timed_clip = false;  // --seconds or --fps were given
};

std::optional<PictureSize> size_of(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(parse_picture_size(text));
}

maquette::SceneRenderer make_renderer(const maquette::Context& context, const maquette::Scene& scene,
                                      const RenderOptions& options) {
  const std::string networks = bundle_or_default(kScenesNetworks, options.bundle);
  maq_scene_renderer_config config = maquette::default_scene_renderer_config();
  config.model.bundle_path = networks.c_str();
  config.model.threads = options.threads;
  config.near_depth = options.near_depth;
  return maquette::SceneRenderer(context, config, scene);
}

float median(std::vector<float> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Renders `repeat` times, fewer after an interrupt; `ms` gets the medians of the times.
maquette::Image timed(maquette::SceneRenderer& renderer, const maq_pinhole_camera& camera, int repeat,
                      nlohmann::ordered_json& ms) {
  std::vector<float> total, project, shade, refine, resample;
  // The first prepares networks for its size; it is left out of the times.
  if (repeat > 1) renderer.run(camera);
  std::unique_ptr<maquette::Image> image;
  for (int i = 0; i < repeat && (i == 0 || !interrupted()); ++i) {
    image.reset();
    image = std::make_unique<maquette::Image>(renderer.run(camera));
    const maq_scene_render_stats stats = image->scene_stats();
    total.push_back(stats.total_ms);
    project.push_back(stats.project_ms);
    shade.push_back(stats.shade_ms);
    refine.push_back(stats.refine_ms);
    resample.push_back(stats.resample_ms);
  }
  ms = {{"total", rounded_ms(double(median(total)))},
        {"project", rounded_ms(double(median(project)))},
        {"shade", rounded_ms(double(median(shade)))},
        {"refine", rounded_ms(double(median(refine)))},
        {"resample", rounded_ms(double(median(resample)))}};
  return std::move(*image);
}

// Indices of the capture's views that `wanted` names: "held-out", "all" or names with commas.
std::vector<uint32_t> chosen_views(const maquette::Capture& capture, const std::string& wanted) {
  std::set<std::string> names;
  std::istringstream list(wanted);
  for (std::string name; std::getline(list, name, ',');) names.insert(name);
  std::vector<uint32_t> chosen;
  for (uint32_t i = 0; i < capture.info().view_count; ++i) {
    const maq_capture_view view = capture.view(i);
    if (wanted == "all" || (wanted == "held-out" && view.is_held_out == 1) || names.erase(view.name) > 0) {
      chosen.push_back(i);
    }
  }
  if (chosen.empty() && wanted == "held-out") {
    throw std::runtime_error("The capture has no held-out photos; use --views all, or names of photos.");
  }
  if (chosen.empty() || (wanted != "all" && wanted != "held-out" && !names.empty())) {
    throw std::runtime_error("The capture has no photo " + (names.empty() ? wanted : *names.begin()) + ".");
  }
  return chosen;
}

std::string image_name(const maq_capture_view& view) { return fs::u8path(view.name).stem().string() + ".png"; }

int render_views(maquette::SceneRenderer& renderer, const maquette::Capture& capture, const RenderOptions& options) {
  const std::vector<uint32_t> views = chosen_views(capture, options.views);
  const std::optional<PictureSize> size = size_of(options.size);
  std::set<std::string> names;
  for (const uint32_t index : views) {
    const std::string name = image_name(capture.view(index));
    if (!names.insert(name).second) {
      throw std::runtime_error("Two photos of the capture would both become " + name +
                               "; name one of them in --views.");
    }
  }
  std::error_code error;
  fs::create_directories(fs::u8path(options.out), error);
  if (error) throw std::runtime_error(options.out + " cannot be made: " + error.message() + ".");
  nlohmann::ordered_json document;
  document["views"] = nlohmann::json::array();
  ProgressBar progress("rendering", int64_t(views.size()));
  for (size_t i = 0; i < views.size() && !interrupted(); ++i) {
    const maq_capture_view view = capture.view(views[i]);
    const maq_pinhole_camera camera = size ? with_size(view.camera, size->width_px, size->height_px) : view.camera;
    nlohmann::ordered_json ms;
    const maquette::Image image = timed(renderer, camera, options.repeat, ms);
    const maq_scene_render_stats stats = image.scene_stats();
    image.save((fs::u8path(options.out) / fs::u8path(image_name(view))).string(),
               options.no_alpha ? MAQ_IMAGE_ALPHA_OFF : MAQ_IMAGE_ALPHA_ON);
    document["views"].push_back({{"name", view.name},
                                 {"ms", ms},
                                 {"drawn_blocks", stats.drawn_block_count},
                                 {"drawn_points", stats.drawn_point_count},
                                 {"shaded_points", stats.shaded_point_count},
                                 {"refined_pixels", stats.refined_pixel_count}});
    char note[32];
    std::snprintf(note, sizeof note, "%.1f ms", ms["total"].get<double>());
    progress.advance(int64_t(i + 1), note);
  }
  progress.finish();
  write_json_file(options.json, document, 2);
  print_output("%s: %zu images\n", options.out.c_str(), document["views"].size());
  return interrupted() ? 1 : 0;
}

std::vector<maq_pinhole_camera> flight(const maquette::Scene& scene, const maquette::Capture* capture,
                                       const RenderOptions& options) {
  constexpr PictureSize kUsual = {640, 480};
  const PictureSize size = size_of(options.size).value_or(kUsual);
  const int frames = std::max(1, int(std::lround(options.seconds * options.fps)));
  if (options.path == "orbit") return flight_around(scene.info(), size.width_px, size.height_px, frames);
  if (capture == nullptr) {
    throw std::runtime_error("--path through follows the cameras of the photos: name their folder with --capture.");
  }
  // More stops a second would move too fast.
  constexpr double kStopsASecond = 1.5;
  const uint32_t count = capture->info().view_count;
  const auto wanted = std::clamp(uint32_t(std::lround(options.seconds * kStopsASecond)) + 1, 2u, std::max(2u, count));
  std::vector<maq_pinhole_camera> stops;
  for (uint32_t i = 0; i < std::min(wanted, count); ++i) {
    stops.push_back(with_size(capture->view(uint32_t(uint64_t(i) * count / std::min(wanted, count))).camera,
                              size.width_px, size.height_px));
  }
  return flight_through(stops, frames);
}

int render_clip(const maquette::Context& context, maquette::SceneRenderer& renderer, const maquette::Scene& scene,
                const maquette::Capture* capture, const RenderOptions& options) {
  const std::vector<maq_pinhole_camera> cameras = flight(scene, capture, options);
  make_folder_of(options.out);
  maquette::Clip clip(context, options.out, options.fps);
  ProgressBar progress("rendering", int64_t(cameras.size()));
  std::vector<float> times_ms;
  for (size_t i = 0; i < cameras.size() && !interrupted(); ++i) {
    const maquette::Image image = renderer.run(cameras[i]);
    clip.add(frame_of(context, image));
    times_ms.push_back(image.scene_stats().total_ms);
    char note[32];
    std::snprintf(note, sizeof note, "%.1f ms", double(times_ms.back()));
    progress.advance(int64_t(i + 1), note);
  }
  progress.finish();
  if (interrupted()) {
    // An incomplete clip does not replace an existing file.
    throw std::runtime_error("Interrupted; " + options.out + " is as it was before.");
  }
  clip.finish();
  const float median_ms = median(times_ms);
  print_output("%s: %zu frames, %.1f ms each (median)\n", options.out.c_str(), times_ms.size(), double(median_ms));
  if (!options.json.empty()) {
    const nlohmann::ordered_json document = {
        {"clip", options.out}, {"frames", times_ms.size()}, {"ms", {{"total", rounded_ms(double(median_ms))}}}};
    write_json_file(options.json, document, 2);
  }
  return 0;
}

int render(const RenderOptions& options) {
  if (options.views.empty() == options.path.empty()) {
    throw std::runtime_error("Nothing to render: give --views with --capture for images, or --path for a clip.");
  }
  if (options.path.empty() ? options.is_timed_clip : options.repeat != 1 || options.no_alpha) {
    throw std::runtime_error(options.path.empty() ? "--seconds and --fps are for clips: use them with --path."
                                                  : "--repeat and --no-alpha are for images: use them with --views.");
  }
  if (!options.views.empty() && options.capture.empty()) {
    throw std::runtime_error("--views needs a capture: name its folder with --capture.");
  }
  require_writable(options.json);
  catch_interrupts();
  const maquette::Context context = open_context();
  const maquette::Scene scene(context, options.scene);
  std::optional<maquette::Capture> capture;
  if (!options.capture.empty()) capture.emplace(context, options.capture);
  maquette::SceneRenderer renderer = make_renderer(context, scene, options);
  return options.path.empty() ? render_views(renderer, *capture, options)
                              : render_clip(context, renderer, scene, capture ? &*capture : nullptr, options);
}

}  // namespace

void add_scene_render_command(CLI::App& scene, int* exit_code) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* command = scene.add_subcommand("render", "Render a scene: images from given cameras, or a clip");
  command->add_option("scene", options->scene, "A file made by `maquette scene build`, or splats (.ply, .spz)")
      ->required();
  command->add_option("-o,--out", options->out, "File of the clip, such as clip.mp4, or folder for the images")
      ->required();
  command
      ->add_option("--path", options->path,
                   "Path of the camera in a clip: `orbit` around the scene, or `through` the cameras of the capture")
      ->check(CLI::IsMember({"orbit", "through"}));
  command->add_option("--seconds", options->seconds, "Length of the clip in seconds")->check(CLI::Range(0.04, 600.0));
  command->add_option("--fps", options->fps, "Frames a second of the clip")->check(CLI::Range(1.0, 240.0));
  command->add_option("--capture", options->capture, "Folder of the capture with the cameras");
  command->add_option("--views", options->views,
                      "Photos of the capture to render: held-out, all, or names with commas");
  command->add_option("--size", options->size, "Size of the images, such as 640x480; default: the size of the photo");
  command->add_option(
      "--bundle", options->bundle,
      "Bundle that built the scene; default: MAQ_SCENE_BUNDLE, then the one installed with this program");
  command->add_option("--near", options->near_depth, "Do not draw points nearer than this, in units of the scene")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--threads", options->threads, "Threads; default: the large cores, at most 4")
      ->check(CLI::Range(1, 64));
  command->add_flag("--no-alpha", options->no_alpha, "Write images without alpha");
  command->add_option("--repeat", options->repeat, "Render each image N times and report median times")
      ->check(CLI::Range(1, 10000));
  command->add_option("--json", options->json, "Write times and counts to this file");
  command->callback([=] {
    options->is_timed_clip = command->count("--seconds") + command->count("--fps") > 0;
    *exit_code = render(*options);
  });
}
