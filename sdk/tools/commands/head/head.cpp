#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "arguments/bundle_argument.h"
#include "arguments/model_options.h"
#include "arguments/source_argument.h"
#include "commands/commands.h"
#include "commands/head/head_commands.h"
#include "interrupt.h"
#include "output/output_file.h"
#include "output/progress_bar.h"
#include "print.h"
#include "program.h"

namespace fs = std::filesystem;

namespace {

using BoxPx = std::array<float, 4>;

struct HeadOptions {
  std::vector<std::string> photos;
  int64_t clip_frames = 8;
  std::string append;  // the prior head; empty: none
  std::string out, save, preview;
  double seconds = 3;
  std::string person = "1";
  std::vector<float> box;
  double roll_deg = 0;
  float focal_px = 0;
  double pupils_mm = 0;
  std::string depth;  // a source, or "photo": the depth that came with the photo
  uint32_t texture_px = 1024;
  bool no_texture = false, delight = false;
  MeshChoice mesh;
  std::string densepose;
  NetworkOptions network;
  bool json = false;
};

constexpr int kHeadPermille = 1000;
constexpr double kRadians = 3.14159265358979323846 / 180;

class LapTimer {
 public:
  // Milliseconds since the last call, or since this was made.
  double lap_ms() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

struct Photo {
  std::string name;  // its URI, and of clips the frame's number
  bool is_of_clip;
  std::vector<uint8_t> pixels;  // of a clip's frame
  maquette::Frame frame;
  float focal_px;            // 0: not known
  std::vector<BoxPx> heads;  // the largest first; empty: none was found
};

// One head to be fitted, and its files.
struct Task {
  size_t person;  // from 0
  std::string out, save, preview;
};

struct Stages {
  double find_ms = 0, encode_ms = 0, pose_ms = 0, fit_ms = 0, mesh_ms = 0;
};

// A frame of a clip, copied: the source needs its own frames to go on.
Photo copied(const maquette::Context& context, const maquette::Frame& frame, std::string name, float focal_px) {
  const maq_frame_desc from = frame.desc();
  std::vector<uint8_t> pixels(size_t(from.width_px) * size_t(from.height_px) * 3);
  frame.copy_pixels(MAQ_PIXEL_BGR8, pixels.data(), 0, pixels.size());
  maq_frame_desc desc;
  maquette::check(maq_frame_desc_init(&desc, sizeof desc));
  desc.format = MAQ_PIXEL_BGR8;
  desc.width_px = from.width_px;
  desc.height_px = from.height_px;
  desc.planes[0] = pixels.data();
  maquette::Frame copy(context, desc);
  return {std::move(name), true, std::move(pixels), std::move(copy), focal_px, {}};
}

// One photo, or frames of a clip, evenly over its length.
std::vector<Photo> read_photos(const HeadOptions& options, const maquette::Context& context, const std::string& text) {
  const SourceArgument argument = parse_source_argument(text);
  maquette::Source source(context, argument.uri);
  const StoppedByInterrupt stopped(source);
  const int64_t count = source.info().frame_count;  // negative: not known
  const int64_t wanted = std::clamp(count, int64_t(1), options.clip_frames);
  std::vector<Photo> photos;
  for (int64_t index = 0; int64_t(photos.size()) < wanted && !interrupted(); ++index) {
    std::optional<maquette::Frame> frame = source.next();
    if (!frame) break;
    const int64_t number = int64_t(photos.size());
    if (index < (2 * number + 1) * count / (2 * wanted)) continue;
    float focal_px = options.focal_px;
    if (focal_px == 0) {
      if (const auto intrinsics = source.intrinsics()) focal_px = float(intrinsics->fx_px);
    }
    if (count <= 1) {
      photos.push_back({argument.uri, false, {}, std::move(*frame), focal_px, {}});
    } else {
      photos.push_back(copied(context, *frame, argument.uri + ", frame " + std::to_string(index), focal_px));
    }
  }
  if (photos.empty()) throw std::runtime_error(argument.uri + " has no image.");
  return photos;
}

// Heads of the people in the photos.
void find_heads(const HeadOptions& options, const maquette::Context& context, std::vector<Photo>& photos) {
  if (!options.box.empty()) {
    for (Photo& photo : photos) photo.heads = {{options.box[0], options.box[1], options.box[2], options.box[3]}};
    return;
  }
#if MAQ_HAS_DENSEPOSE
  const std::string bundle = options.densepose.empty() ? default_bundle(kDenseposeNetworks) : options.densepose;
  if (bundle.empty()) {
    print_error("No bundle of dense pose was found, so the head is detected without it; see --densepose, --box.\n");
    return;
  }
  maq_densepose_config config = maquette::default_densepose_config();
  config.model.bundle_path = bundle.c_str();
  config.model.threads = options.network.threads;
  config.detail = MAQ_DENSEPOSE_DETAIL_PART;
  maquette::DensePose densepose(context, config);
  for (Photo& photo : photos) {
    const maquette::DensePoseResult result = densepose.run(photo.frame);
    for (uint32_t i = 0; i < result.person_count(); ++i) {
      if (const auto box = result.head_box_px(i)) photo.heads.push_back(*box);
    }
    const auto area = [](const BoxPx& box) { return (box[2] - box[0]) * (box[3] - box[1]); };
    std::stable_sort(photo.heads.begin(), photo.heads.end(),
                     [&](const BoxPx& a, const BoxPx& b) { return area(a) > area(b); });
  }
  // Leaves out frames of clips without a head where any photo shows one.
  const auto shows_somebody = [](const Photo& photo) { return !photo.heads.empty(); };
  if (std::any_of(photos.begin(), photos.end(), shows_somebody)) {
    const auto is_empty = [&](const Photo& photo) { return photo.is_of_clip && !shows_somebody(photo); };
    photos.erase(std::remove_if(photos.begin(), photos.end(), is_empty), photos.end());
  }
#else
  (void)context;
  print_error("This build has no dense pose, so the head is detected in the middle of the photo; see --box.\n");
#endif
}

// head.glb -> head_2.glb.
std::string with_number(const std::string& path, size_t number) {
  if (path.empty()) return path;
  const fs::path given = fs::u8path(path);
  const std::string name = given.stem().string() + "_" + std::to_string(number) + given.extension().string();
  return (given.parent_path() / fs::u8path(name)).string();
}

std::vector<Task> tasks_of(const HeadOptions& options, const std::vector<Photo>& photos) {
  const Photo& first = photos.front();
  if (options.person != "all") {
    const size_t person = size_t(std::stoul(options.person)) - 1;
    if (person > 0 && person >= first.heads.size()) {
      throw std::runtime_error(first.name + " shows " + std::to_string(first.heads.size()) +
                               " heads, so there is no person " + options.person + "; name another, or --box.");
    }
    return {{person, options.out, options.save, options.preview}};
  }
  if (first.heads.empty()) throw std::runtime_error(first.name + " shows no heads of people.");
  std::vector<Task> tasks;
  for (size_t i = 0; i < first.heads.size(); ++i) {
    tasks.push_back(
        {i, with_number(options.out, i + 1), with_number(options.save, i + 1), with_number(options.preview, i + 1)});
  }
  return tasks;
}

using UsedPhotos = std::vector<const Photo*>;  // in the order of the builder

// Adds all photos. Frames of clips without a head are left out, unless none has one.
UsedPhotos add_photos(const HeadOptions& options, const std::vector<Photo>& photos, const Task& task,
                      maquette::HeadBuilder& builder) {
  UsedPhotos used;
  for (const Photo& photo : photos) {
    maq_head_photo known = maquette::default_head_photo();
    if (!photo.heads.empty()) {
      const BoxPx& box = photo.heads[std::min(task.person, photo.heads.size() - 1)];
      std::copy(box.begin(), box.end(), known.box_px);
    }
    known.roll_rad = float(options.roll_deg * kRadians);
    known.focal_px = photo.focal_px;
    try {
      builder.add_photo(photo.frame, known);
      used.push_back(&photo);
    } catch (const maquette::Error& error) {
      const bool is_last = &photo == &photos.back() && used.empty();
      if (photo.is_of_clip && error.status() == MAQ_ERROR_NOT_FOUND && !is_last) continue;
      throw std::runtime_error(photo.name + ": " + error.what());
    }
  }
  return used;
}

nlohmann::ordered_json describe_photo(const Photo& photo, const maq_head_photo_info& found) {
  return {{"photo", photo.name},
          {"box_px", found.box_px},
          {"used", found.is_used != 0},
          {"focal_px", found.focal_px},
          {"focal_known", photo.focal_px > 0},
          {"rms_px", found.rms_px}};
}

void print_photo(const Photo& photo, const maq_head_photo_info& found) {
  const float* const box = found.box_px;
  print_output("%s  head of %.0f x %.0f px", photo.name.c_str(), double(box[2] - box[0]), double(box[3] - box[1]));
  if (found.is_used == 0) {
    print_output("  rejected: it shows no head, or a different person\n");
    return;
  }
  print_output("  focal length %.0f px (%s)  points within %.1f px\n", double(found.focal_px),
               photo.focal_px > 0 ? "given" : "estimated", double(found.rms_px));
}

void print_result(const HeadOptions& options, const UsedPhotos& photos, const Task& task,
                  const maquette::HeadBuilder& builder, const maquette::Head& head, const maq_head_mesh_data* mesh,
                  const Stages& stages, const std::string& of_preview) {
  const maq_head_info info = head.info();
  const maq_head_build_stats stats = builder.stats();
  const double pupils_m = pupil_distance_m(head);
  if (options.json) {
    nlohmann::ordered_json document = {{"person", task.person + 1}, {"photos", nlohmann::ordered_json::array()}};
    for (uint32_t i = 0; i < photos.size(); ++i)
      document["photos"].push_back(describe_photo(*photos[i], builder.photo(i)));
    if (!task.out.empty()) document["out"] = task.out;
    if (!task.save.empty()) document["save"] = task.save;
    if (!task.preview.empty()) document["preview"] = task.preview;
    if (mesh != nullptr) {
      document["vertices"] = mesh->vertex_count, document["triangles"] = mesh->triangle_count;
      if (mesh->morph_target_count > 0) document["morph_targets"] = mesh->morph_target_count;
      document["simplification_error_mm"] = std::round(1e6 * double(mesh->simplification_error_m)) / 1e3;
    }
    document["scale"] = name_of_scale(info.scale);
    document["scale_sigma"] = info.scale_sigma;
    if (pupils_m > 0) document["pupil_distance_m"] = pupils_m;
    document["steps"] = stats.step_count;
    document["threads"] = stats.threads;
    document["provider"] = name_of(stats.provider);
    document["ms"] = {{"find", rounded_ms(stages.find_ms)},
                      {"encode", rounded_ms(stages.encode_ms)},
                      {"pose", rounded_ms(stages.pose_ms)},
                      {"fit", rounded_ms(stages.fit_ms)},
                      {"mesh", rounded_ms(stages.mesh_ms)}};
    print_output("%s\n", json_text(document).c_str());
    flush_output();
    return;
  }
  for (uint32_t i = 0; i < photos.size(); ++i) print_photo(*photos[i], builder.photo(i));
  print_output("  size %s", text_of_scale(info).c_str());
  if (pupils_m > 0) print_output("; pupils %.0f mm apart", 1e3 * pupils_m);
  print_output("\n  find people %.0f | encode %.0f | pose %.0f | fit %.0f (%d steps) | mesh and files %.0f ms\n",
               stages.find_ms, stages.encode_ms, stages.pose_ms, stages.fit_ms, stats.step_count, stages.mesh_ms);
  if (mesh != nullptr) print_output("%s", text_of_mesh(task.out, *mesh).c_str());
  if (!task.save.empty()) print_output("%s: the head itself; see `maquette head info`\n", task.save.c_str());
  print_output("%s", of_preview.c_str());
}

// Scales the head as the options say.
maquette::Head sized(const HeadOptions& options, const maquette::Context& context, const Photo& first,
                     const maquette::HeadBuilder& builder, maquette::Head head) {
  if (options.pupils_mm > 0) return head.scaled_by_distance("pupil_left", "pupil_right", 1e-3 * options.pupils_mm);
  if (options.depth.empty()) return head;
  if (builder.photo(0).is_used == 0) throw std::runtime_error("The first photo, whose depth is given, was rejected.");
  if (options.depth != "photo") return head.scaled_by_depth(read_photos(options, context, options.depth).front().frame);
  if (!first.frame.depth()) {
    throw std::runtime_error(first.name +
                             " came without depth; name its depth image: --depth 'image:depth.png?depth_unit=0.001'.");
  }
  return head.scaled_by_depth(first.frame);
}

// The bar of the fit that runs, for the progress callback.
struct FitProgress {
  ProgressBar* bar = nullptr;

  static int32_t show(void* progress, double done, const char*) {
    ProgressBar* const bar = static_cast<FitProgress*>(progress)->bar;
    if (bar != nullptr) bar->advance(int64_t(done * kHeadPermille), "");
    return interrupted() ? 0 : 1;
  }
};

maquette::Head fit_head(const HeadOptions& options, maquette::HeadBuilder& builder, FitProgress& progress) {
  ProgressBar bar("fitting", kHeadPermille, ProgressBar::Shown::kPercent);
  progress.bar = &bar;
  try {
    maquette::Head head = builder.fit(options.seconds);
    progress.bar = nullptr;
    bar.finish();
    return head;
  } catch (const maquette::Error&) {
    progress.bar = nullptr;
    if (!interrupted()) throw;
    throw std::runtime_error("Interrupted; no file was written.");
  }
}

void fit_one(const HeadOptions& options, const maquette::Context& context, const std::vector<Photo>& photos,
             const Task& task, maquette::HeadBuilder& builder, FitProgress& progress, Stages stages) {
  builder.clear();
  if (!options.append.empty()) builder.add_head(maquette::Head::open(context, options.append));
  LapTimer timer;
  const UsedPhotos used = add_photos(options, photos, task, builder);
  stages.encode_ms = timer.lap_ms();
  const maquette::Head head = sized(options, context, *used.front(), builder, fit_head(options, builder, progress));
  const maq_head_build_stats stats = builder.stats();
  stages.pose_ms = double(stats.pose_ms), stages.fit_ms = double(stats.fit_ms);
  timer.lap_ms();
  std::optional<maquette::HeadMesh> mesh;
  if (!task.out.empty() || !task.preview.empty()) mesh.emplace(head, mesh_config(options.mesh));
  if (!task.out.empty()) mesh->save(task.out);
  if (!task.save.empty()) head.save(task.save);
  stages.mesh_ms = timer.lap_ms();
  std::string of_preview;
  if (!task.preview.empty()) {
    HeadView view;
    view.threads = options.network.threads;
    of_preview = write_head_view(context, head, *mesh, task.preview, view);
  }
  const maq_head_mesh_data data = mesh ? mesh->data() : maq_head_mesh_data{};
  print_result(options, used, task, builder, head, task.out.empty() ? nullptr : &data, stages, of_preview);
}

void require_files(const HeadOptions& options, const std::vector<Task>& tasks) {
  for (const Task& task : tasks) {
    for (const std::string* path : {&task.out, &task.save, &task.preview}) {
      if (path->empty()) continue;
      make_folder_of(*path);
      require_writable(*path);
    }
  }
  if (!options.save.empty() && options.save == options.out) {
    throw std::runtime_error("--out and --save are the same file; give each a name of its own.");
  }
  if (!options.append.empty() && options.person == "all") {
    throw std::runtime_error("--append takes the head of one person; name the person, not --person all.");
  }
}

// `bundle` and `progress` must outlive the configuration.
maq_head_builder_config builder_config(const HeadOptions& options, const std::string& bundle, FitProgress& progress) {
  maq_head_builder_config config = maquette::default_head_builder_config();
  config.model.bundle_path = bundle.c_str();
  config.model.threads = options.network.threads;
  config.model.provider = provider_of(options.network);
  config.texture = options.no_texture ? MAQ_HEAD_TEXTURE_OFF : MAQ_HEAD_TEXTURE_ON;
  config.texture_px = options.no_texture ? 0 : options.texture_px;
  config.delight_texture = options.delight ? 1 : 0;
  config.progress_callback = FitProgress::show;
  config.progress_user_data = &progress;
  return config;
}

int run_head(const HeadOptions& options) {
  catch_interrupts();
  const std::string bundle = bundle_or_default(kHeadsNetworks, options.network.bundle);
  const maquette::Context context = open_context();
  std::vector<Photo> photos;
  for (const std::string& text : options.photos) {
    for (Photo& photo : read_photos(options, context, text)) photos.push_back(std::move(photo));
  }
  if (photos.size() > 1 && (options.person != "1" || !options.box.empty())) {
    throw std::runtime_error("--person and --box are for a single photo, not for a clip; see --frames.");
  }
  FitProgress progress;
  maquette::HeadBuilder builder(context, builder_config(options, bundle, progress));
  Stages stages;
  LapTimer timer;
  find_heads(options, context, photos);
  stages.find_ms = timer.lap_ms();
  const std::vector<Task> tasks = tasks_of(options, photos);
  require_files(options, tasks);
  int failed = 0;
  for (const Task& task : tasks) {
    if (tasks.size() == 1) {
      fit_one(options, context, photos, task, builder, progress, stages);
      continue;
    }
    try {
      if (!interrupted()) fit_one(options, context, photos, task, builder, progress, stages);
    } catch (const OutputLost&) {
      throw;
    } catch (const std::exception& error) {
      flush_output();
      print_error("maquette: person %zu: %s\n", task.person + 1, printable(error.what()).c_str());
      ++failed;
    }
  }
  return failed == 0 && !interrupted() ? 0 : 1;
}

std::string check_person(const std::string& text) {
  const CLI::Range person(1, 255);
  return text == "all" || person(text).empty() ? std::string() : text + " is neither 1 to 255 nor \"all\"";
}

void add_photo_options(CLI::App& command, HeadOptions& options) {
  command.add_option("--frames", options.clip_frames, "Number of frames to use of a clip, evenly spaced (default 8)")
      ->check(CLI::Range(int64_t(1), int64_t(64)));
  command
      .add_option("--person", options.person,
                  "Person in a photo of several: 1 (default) has the largest head, 2 the next; all writes a file each "
                  "(head_1.glb, head_2.glb)")
      ->check(CLI::Validator(check_person, "1 to 255, or all"));
  command
      .add_option("--box", options.box,
                  "Box of the head with its hair, in pixels: left,top,right,bottom; default: people are detected")
      ->delimiter(',')
      ->expected(4);
  command.add_option("--roll", options.roll_deg, "Rotation of the head in the photo, clockwise, degrees")
      ->check(CLI::Range(-360.0, 360.0));
  command
      .add_option("--focal-px", options.focal_px,
                  "Focal length of the camera in pixels of the photo; default: the photo's fov=, or estimated")
      ->check(CLI::Range(1e-3f, 1e9f));
#if MAQ_HAS_DENSEPOSE
  command.add_option("--densepose", options.densepose,
                     "Folder of the bundle that detects people; default: MAQ_BUNDLE, then the installed one");
#endif
}

void add_output_options(CLI::App& command, HeadOptions& options) {
  add_mesh_file_option(command, options.out);
  command.add_option("--save", options.save, "Also write the head itself, some 64 KB: head.maqh");
  command.add_option("--preview", options.preview, "Also write a clip of the head turning, turn.mp4, or an image")
      ->check(CLI::Validator(check_head_view_name, ".mp4, .png or .jpg"));
  command.add_flag("--json", options.json, "Print the result as one JSON line per head");
}

void add_fit_options(CLI::App& command, HeadOptions& options) {
  command.add_option("--append", options.append,
                     "Start from this head, head.maqh, of the same person; its photos are not needed again");
  command
      .add_option("--seconds", options.seconds,
                  "Time for the fit to the pixels (default 3); 0: only the network's first estimate")
      ->check(CLI::Range(0.0, 3600.0));
  CLI::Option* const pupils = command
                                  .add_option("--pupils", options.pupils_mm,
                                              "Distance of the pupils in mm, as opticians measure it; scales the head")
                                  ->check(CLI::Range(10.0, 200.0));
  command
      .add_option("--depth", options.depth,
                  "Depth image of the first photo's view, 'image:depth.png?depth_unit=0.001'; or photo: the depth that "
                  "came with it. Scales the head.")
      ->excludes(pupils);
}

void add_mesh_options(CLI::App& command, HeadOptions& options) {
  add_mesh_choice(command, options.mesh);
  CLI::Option* const no_texture =
      command.add_flag("--no-texture", options.no_texture,
                       "Give the head only the network's colours, blurred eyes included: no part of a photo is in it");
  command
      .add_option("--texture", options.texture_px,
                  "Pixels a side of the texture, which shows the photos' pixels, 256 to 2048 (default 1024)")
      ->check(CLI::Range(256u, 2048u))
      ->excludes(no_texture);
  command
      .add_flag("--delight", options.delight,
                "Remove directional light of the photos from the texture, for programs that relight it")
      ->excludes(no_texture);
}

constexpr char kHeadFooter[] =
    "The .glb is animatable: it has the photo as its texture, eyes, teeth, 52 facial actions and 15 visemes as morph\n"
    "targets. Joints turn neck, head, jaw and eyes. All heads have the same vertices and texture coordinates.\n"
    "With --triangles, the mesh is instead the dense, closed surface, which shows hair and beards better.\n"
    "Lengths are in metres, with y up and the face to the front. A photo does not tell the size of a head:\n"
    "it is an average size, unless --pupils or --depth gives the size.\n"
    "Parts that no photo shows, such as the back of the head, follow from similar heads. More photos of the same\n"
    "person, from the sides, help; each may have another camera. Faces should be 64 pixels or more across.\n\n"
    "A face is biometric data: ask the person. Nothing leaves this machine. A saved head holds pixels of\n"
    "the face; with --no-texture it holds no part of a photo.\n\n"
    "Examples:\n"
    "  maquette head photo.jpg --out head.glb\n"
    "  maquette head front.jpg left.jpg right.jpg --out head.glb --seconds 10 --save head.maqh\n"
    "  maquette head turn.mp4 --out head.glb --frames 8\n"
    "  maquette head right.jpg --append head.maqh --out head.glb --save head.maqh\n"
    "  maquette head group.jpg --out heads/head.ply --person all\n"
    "  maquette head portrait.png --out head.obj --box 120,40,380,390 --focal-px 900\n"
    "  maquette head photo.jpg --out head.glb --pupils 63\n"
    "  maquette head photo.jpg --out head.glb --no-texture\n"
    "  maquette head photo.jpg --out surface.ply --triangles 60000\n"
    "  maquette head photo.jpg --out head.glb --preview turn.mp4\n"
    "  maquette head export head.maqh --out head.obj --triangles 5000\n"
    "  maquette head render head.maqh --out view.png --yaw 30\n"
    "  maquette head info head.maqh";

}  // namespace

void add_head_command(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<HeadOptions>();
  CLI::App* command = app.add_subcommand("head", "Make a 3D head from photos of one person, or from a clip");
  CLI::Option* const photos =
      command->add_option("photo", options->photos,
                          "Photos of one person: photo.jpg, 'image:photo.jpg?fov=60'; or a clip in which the head "
                          "turns: turn.mp4");
  add_output_options(*command, *options);
  add_photo_options(*command, *options);
  add_fit_options(*command, *options);
  add_mesh_options(*command, *options);
  add_network_options(*command, options->network, "MAQ_HEADS_BUNDLE");
  command->footer(kHeadFooter);
  command->require_subcommand(0, 1);
  add_head_info_command(*command, exit_code);
  add_head_export_command(*command, exit_code);
  add_head_render_command(*command, exit_code);
  command->callback([=] {
    if (!command->get_subcommands().empty()) return;
    if (photos->empty()) throw CLI::RequiredError(photos->get_name());
    if (options->out.empty() && options->save.empty() && options->preview.empty()) {
      throw CLI::RequiredError("--out, --save or --preview");
    }
    if (options->photos.size() > 1 && (options->person != "1" || !options->box.empty())) {
      throw CLI::ValidationError("--person and --box", "are for a single photo");
    }
    *exit_code = run_head(*options);
  });
}
