#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <stdexcept>

#include "arguments/bundle_argument.h"
#include "arguments/picture_size.h"
#include "commands/head/head_commands.h"
#include "interrupt.h"
#include "output/frame_image.h"
#include "output/output_file.h"
#include "output/progress_bar.h"
#include "print.h"
#include "program.h"

namespace {

constexpr std::array<const char*, 5> kShadingNames = {"colour", "shape", "normals", "template", "depth"};
constexpr double kDegree_rad = 3.14159265358979323846 / 180;

struct HeadRenderOptions {
  std::string head, out, size, bundle, shading = "colour";
  MeshChoice mesh;
  bool no_alpha = false, is_timed_clip = false, has_angle = false;
  HeadView view;
};

bool is_clip_name(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  return ending == ".mp4";
}

maq_pinhole_camera camera_of_view(const maquette::Head& head, const maquette::HeadRenderer& renderer,
                                  const HeadView& view) {
  if (view.photo == 0) {
    return renderer.camera(view.yaw_deg * kDegree_rad, view.pitch_deg * kDegree_rad, view.width_px, view.height_px);
  }
  const uint32_t count = head.info().photo_count;
  if (uint32_t(view.photo) > count) {
    throw std::runtime_error("The head was fitted to " + std::to_string(count) + " photo(s), so there is no photo " +
                             std::to_string(view.photo) + ".");
  }
  return head.camera(uint32_t(view.photo - 1));
}

std::string write_turn(const maquette::Context& context, maquette::HeadRenderer& renderer, const std::string& path,
                       const HeadView& view) {
  const int frames = std::max(1, int(std::lround(view.seconds * view.fps)));
  maquette::Clip clip(context, path, view.fps);
  ProgressBar progress("turning", frames);
  double rendering_ms = 0;
  for (int i = 0; i < frames; ++i) {
    if (interrupted()) throw std::runtime_error("Interrupted; " + path + " is as it was before.");
    const double yaw_rad = (view.yaw_deg + 360.0 * i / frames) * kDegree_rad;
    const maq_pinhole_camera camera =
        renderer.camera(yaw_rad, view.pitch_deg * kDegree_rad, view.width_px, view.height_px);
    const auto start = std::chrono::steady_clock::now();
    const maquette::Image image = renderer.run(camera);
    rendering_ms += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    clip.add(frame_of(context, image));
    progress.advance(i + 1, "");
  }
  progress.finish();
  clip.finish();
  char text[64];
  std::snprintf(text, sizeof text, ": %d frames, %.1f ms each\n", frames, rendering_ms / frames);
  return path + text;
}

int render_head(const HeadRenderOptions& given) {
  HeadView view = given.view;
  const auto name = std::find(kShadingNames.begin(), kShadingNames.end(), given.shading);
  view.shading = maq_head_shading(name - kShadingNames.begin());
  maq_head_mesh_config mesh = mesh_config(given.mesh);
  const std::string bundle = bundle_of_mesh(mesh, given.bundle);
  mesh.model.bundle_path = bundle.empty() ? nullptr : bundle.c_str();
  mesh.model.threads = view.threads;
  view.with_alpha = !given.no_alpha;
  if (!given.size.empty()) {
    const PictureSize size = parse_picture_size(given.size);
    view.width_px = size.width_px, view.height_px = size.height_px;
  }
  if (!is_clip_name(given.out) && given.is_timed_clip) {
    throw std::runtime_error("--seconds and --fps are for clips: write one to turn.mp4.");
  }
  if (view.photo != 0 && (is_clip_name(given.out) || given.has_angle || !given.size.empty())) {
    throw std::runtime_error(
        "--photo is one view, of the photo's size: leave out --yaw, --pitch and --size, and write .png.");
  }
  catch_interrupts();
  const maquette::Context context = open_context();
  const maquette::Head head = maquette::Head::open(context, given.head);
  print_output("%s", write_head_view(context, head, maquette::HeadMesh(head, mesh), given.out, view).c_str());
  return 0;
}

}  // namespace

std::string check_head_view_name(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  const bool is_picture = ending == ".png" || ending == ".jpg" || ending == ".jpeg";
  return is_picture || is_clip_name(path) ? std::string() : path + " must end with .png, .jpg or .mp4";
}

std::string write_head_view(const maquette::Context& context, const maquette::Head& head,
                            const maquette::HeadMesh& mesh, const std::string& path, const HeadView& view) {
  make_folder_of(path);
  const bool with_alpha = view.with_alpha && std::filesystem::path(path).extension() == ".png";
  maq_head_renderer_config config = maquette::default_head_renderer_config();
  config.threads = view.threads;
  config.shading = view.shading;
  config.use_background = with_alpha ? 0 : 1;
  for (size_t channel = 0; channel < 3; ++channel) config.background[channel] = uint8_t(view.background_rgb[channel]);
  maquette::HeadRenderer renderer(context, config, mesh);
  if (is_clip_name(path)) return write_turn(context, renderer, path, view);
  renderer.run(camera_of_view(head, renderer, view)).save(path, with_alpha ? MAQ_IMAGE_ALPHA_ON : MAQ_IMAGE_ALPHA_OFF);
  return path + "\n";
}

void add_head_render_command(CLI::App& head, int* exit_code) {
  auto options = std::make_shared<HeadRenderOptions>();
  HeadView& view = options->view;
  CLI::App* command = head.add_subcommand("render", "Render a saved head: an image, or a clip in which it turns");
  command->add_option("head", options->head, "File that `maquette head --save` wrote")->required();
  command->add_option("-o,--out", options->out, "Image (.png, .jpg), or clip of one turn (.mp4)")
      ->required()
      ->check(CLI::Validator(check_head_view_name, ".png, .jpg or .mp4"));
  command
      ->add_option("--shading", options->shading, "Colours to show: colour (default), shape, normals, template, depth")
      ->check(CLI::IsMember(kShadingNames));
  command
      ->add_option("--yaw", view.yaw_deg,
                   "Angle of the camera from the front to the person's left, degrees; clips begin there")
      ->check(CLI::Range(-3600.0, 3600.0));
  command->add_option("--pitch", view.pitch_deg, "Angle of the camera upwards, degrees")
      ->check(CLI::Range(-90.0, 90.0));
  command
      ->add_option("--photo", view.photo, "Use the camera of photo N (from 1): the image matches the head in the photo")
      ->check(CLI::Range(1, 256));
  command->add_option("--size", options->size, "Size of the image (default 640x480)");
  command->add_option("--seconds", view.seconds, "Length of a clip (default 6)")->check(CLI::Range(0.04, 600.0));
  command->add_option("--fps", view.fps, "Frames a second of a clip (default 25)")->check(CLI::Range(1.0, 240.0));
  command
      ->add_option("--background", view.background_rgb, "Red,green,blue behind the head, 0 to 255 (default 46,48,54)")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::Range(0, 255));
  command->add_flag("--no-alpha", options->no_alpha,
                    "Write a PNG with the background; default: transparent around the head");
  add_mesh_choice(*command, options->mesh);
  add_template_bundle_option(*command, options->bundle);
  command->add_option("--threads", view.threads, "Threads; default: the large cores, at most 4")
      ->check(CLI::Range(1, 64));
  command->footer(
      "Shadings:\n"
      "  colour, shape   the head's colours, or grey, in soft light\n"
      "  normals         red to the right, green up, blue to the camera\n"
      "  template        position on the template head: red to the person's left, green up, blue to the front\n"
      "  depth           near is white, far is black\n\n"
      "Examples:\n"
      "  maquette head photo.jpg --save head.maqh\n"
      "  maquette head render head.maqh --out view.png --yaw 30 --pitch 10\n"
      "  maquette head render head.maqh --out turn.mp4 --shading normals --seconds 4\n"
      "  maquette head render head.maqh --out over_photo.png --photo 1");
  command->callback([=] {
    options->is_timed_clip = command->count("--seconds") + command->count("--fps") > 0;
    options->has_angle = command->count("--yaw") + command->count("--pitch") > 0;
    *exit_code = render_head(*options);
  });
}
