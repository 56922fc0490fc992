#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "arguments/densepose_options.h"
#include "commands/commands.h"
#include "commands/source_frames.h"
#include "output/clip_file.h"
#include "output/frame_image.h"
#include "output/output_file.h"
#include "output/overlay.h"
#include "output/prediction_mark.h"
#include "print.h"
#include "program.h"

namespace fs = std::filesystem;

namespace {

struct DensePoseOptions {
  std::vector<std::string> sources;
  ModelOptions model;
  std::string out;
  bool overlay = false;
  bool textures = false;
  std::string colours = "default";
  bool json = false;
  double roll_deg = 0;
  FrameLimits limits;
};

// The stages of a run, in order, with their times of every frame.
class Timings {
 public:
  void add(const maq_densepose_stats& stats) {
    const float values[] = {stats.preprocess_ms, stats.trunk_ms,      stats.proposals_ms,
                            stats.box_head_ms,   stats.dense_head_ms, stats.crops_ms,
                            stats.decode_ms,     stats.keypoints_ms,  stats.total_ms};
    for (size_t i = 0; i < kStages; ++i) ms_[i].push_back(values[i]);
    people_ += stats.person_count;
  }

  size_t frames() const { return ms_[0].size(); }
  int64_t people() const { return people_; }
  float median_total_ms() const { return median(ms_[kStages - 1]); }

  void print() const {
    print_output("%zu frame%s, %lld %s. Median of a frame: %.1f ms (%.1f FPS)\n", frames(), frames() == 1 ? "" : "s",
                 (long long)people_, people_ == 1 ? "person" : "people", double(median_total_ms()),
                 1000.0 / std::max(1e-3, double(median_total_ms())));
    constexpr const char* kNames[] = {"preprocess", "trunk", "proposals", "box head",
                                      "dense head", "crops", "decode",    "keypoints"};
    for (size_t i = 0; i + 1 < kStages; ++i) {
      print_output("%s%s %.1f", i == 0 ? "  " : " | ", kNames[i], double(median(ms_[i])));
    }
    print_output(" ms\n");
  }

 private:
  static constexpr size_t kStages = 9;

  static float median(std::vector<float> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }

  std::vector<float> ms_[kStages];
  int64_t people_ = 0;
};

void print_frame(const DensePoseOptions& options, const std::string& stem, const maq_frame_desc& desc,
                 const maq_densepose_stats& stats) {
  if (options.json) {
    const nlohmann::ordered_json line = {{"frame", stem},
                                         {"timestamp_ns", desc.timestamp_ns},
                                         {"people", stats.person_count},
                                         {"key_frame", stats.is_key_frame != 0},
                                         {"proposals", stats.proposal_count},
                                         {"crops", stats.crop_count},
                                         {"network", {stats.network_width_px, stats.network_height_px}},
                                         {"provider", name_of(stats.provider)},
                                         {"threads", stats.threads},
                                         {"threads_measured", stats.is_threads_measured != 0},
                                         {"ms",
                                          {{"preprocess", rounded_ms(double(stats.preprocess_ms))},
                                           {"trunk", rounded_ms(double(stats.trunk_ms))},
                                           {"proposals", rounded_ms(double(stats.proposals_ms))},
                                           {"box_head", rounded_ms(double(stats.box_head_ms))},
                                           {"dense_head", rounded_ms(double(stats.dense_head_ms))},
                                           {"crops", rounded_ms(double(stats.crops_ms))},
                                           {"decode", rounded_ms(double(stats.decode_ms))},
                                           {"keypoints", rounded_ms(double(stats.keypoints_ms))},
                                           {"total", rounded_ms(double(stats.total_ms))}}}};
    print_output("%s\n", json_text(line).c_str());
    flush_output();  // for who reads line by line
  } else {
    print_output("%s  %d x %d  %d %s  %.1f ms\n", stem.c_str(), desc.width_px, desc.height_px, stats.person_count,
                 stats.person_count == 1 ? "person" : "people", double(stats.total_ms));
  }
}

// The textures of the people of a source, by id.
class Textures {
 public:
  explicit Textures(const maquette::Context& context) : context_(context) {}

  void add(const maquette::DensePoseResult& result, const maquette::Frame& frame) {
    const std::vector<maq_densepose_person> people = result.people();
    for (uint32_t i = 0; i < people.size(); ++i) {
      auto found = of_id_.find(people[i].id);
      if (found == of_id_.end() && of_id_.size() >= kMaxPeople) continue;
      if (found == of_id_.end()) found = of_id_.emplace(people[i].id, maquette::DensePoseTexture(context_)).first;
      found->second.add_person(result, i, frame);
    }
  }

  // Writes <path>_person<id>_texture.png of each.
  void save(const fs::path& path) {
    for (auto& [id, texture] : of_id_) texture.save(path.string() + "_person" + std::to_string(id) + "_texture.png");
  }

 private:
  static constexpr size_t kMaxPeople = 100;  // 1.6 MB each
  const maquette::Context& context_;
  std::map<int64_t, maquette::DensePoseTexture> of_id_;
};

// Runs one source to its end and writes its files.
void run_source(const DensePoseOptions& options, const SourceArgument& argument, const maquette::Context& context,
                maquette::Source& source, maquette::DensePose& densepose, Timings& timings) {
  densepose.reset();
  const bool of_clip = is_clip(source);
  ClipFile clip(context, fs::u8path(options.out) / fs::u8path(argument.stem + "_overlay.mp4"),
                source.info().fps / double(options.limits.every));
  Textures textures(context);
  const auto work = [&](const SourceFrame& given) {
    const maquette::DensePoseResult result = densepose.run(given.frame);
    const maq_densepose_stats stats = result.stats();
    // Drawn before the first file is written, so that a frame has all its files or none.
    Canvas overlay;
    if (options.overlay && options.colours == "default") {
      overlay = draw_overlay(image_of(given.frame), result, options.model.keypoints);
    } else if (options.overlay) {
      overlay = draw_parts(result, options.colours == "detectron2" ? MAQ_DENSEPOSE_COLOURS_DETECTRON2
                                                                   : MAQ_DENSEPOSE_COLOURS_MAGICANIMATE);
    }
    if (options.overlay) draw_prediction_mark(given.frame, overlay);
    make_folder_of(fs::u8path(options.out) / fs::u8path(given.stem + "_IUV.png"));
    result.save((fs::u8path(options.out) / fs::u8path(given.stem)).string());
    if (options.overlay && of_clip) clip.add(overlay);
    if (options.overlay && !of_clip) {
      frame_of(context, overlay).save((fs::u8path(options.out) / fs::u8path(given.stem + "_overlay.png")).string());
    }
    if (options.textures) textures.add(result, given.frame);
    timings.add(stats);
    if (!of_clip || options.json) print_frame(options, given.stem, given.frame.desc(), stats);
    return std::to_string(stats.person_count) + " people";
  };
  const int64_t done = run_frames(argument, source, options.limits, options.json, work);
  const fs::path overlay_path = clip.finish();
  textures.save(fs::u8path(options.out) / fs::u8path(argument.stem));
  if (!overlay_path.empty() && !options.json) {
    print_output("%s  %lld frames -> %s\n", argument.stem.c_str(), (long long)done, overlay_path.string().c_str());
  } else if (of_clip && !options.json) {
    print_output("%s  %lld frames\n", argument.stem.c_str(), (long long)done);
  }
}

int run_densepose(const DensePoseOptions& options) {
  const std::vector<SourceArgument> arguments = parse_sources(options.sources);
  const std::string bundle = bundle_of(options.model);
  const maquette::Context context = open_context();
  std::unique_ptr<maquette::DensePose> for_photos, for_streams;
  Timings timings;
  const auto model_for = [&](const maquette::Source& source) -> std::unique_ptr<maquette::DensePose>& {
    return is_clip(source) ? for_streams : for_photos;
  };
  const auto load = [&](const maquette::Source& source) {
    std::unique_ptr<maquette::DensePose>& model = model_for(source);
    if (model != nullptr) return;
    model = std::make_unique<maquette::DensePose>(context, config_of(options.model, bundle, !is_clip(source)));
    constexpr double degree_rad = 3.14159265358979323846 / 180;
    model->set_roll(float(options.roll_deg * degree_rad));
  };
  const auto run = [&](const SourceArgument& argument, maquette::Source& source) {
    run_source(options, argument, context, source, *model_for(source), timings);
  };
  const int exit_code = run_sources(context, arguments, load, run);
  if (timings.frames() > 0 && !options.json) timings.print();
  return exit_code;
}

}  // namespace

void add_densepose_command(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<DensePoseOptions>();
  CLI::App* command =
      app.add_subcommand("densepose", "Map each pixel of the people in images or clips to the body surface");
  command
      ->add_option("source", options->sources,
                   "Images, clips or URIs: photo.jpg, video:clip.mp4, stub:people?count=3 (see `maquette sources`)")
      ->required();
  command->add_option("-o,--out", options->out, "Folder for the results; created if needed")->required();
  command->add_flag("--overlay", options->overlay,
                    "Also draw parts, U/V contours and boxes: <stem>_overlay.png, for clips <stem>_overlay.mp4");
  command->add_flag(
      "--textures", options->textures,
      "Also write the colours of each person on the body surface, of all frames: <stem>_person<id>_texture.png");
  command
      ->add_option(
          "--colours", options->colours,
          "Colours of --overlay: default, detectron2 (for ControlNet) or magicanimate. The latter two show the "
          "parts alone, on the ground that these models expect")
      ->check(CLI::IsMember({"default", "detectron2", "magicanimate"}));
  command->add_flag("--json", options->json, "Print counts and times as one JSON line per frame");
  add_model_options(*command, options->model);
  command
      ->add_option(
          "--roll", options->roll_deg,
          "Roll of the camera: the frames show the world rotated clockwise by N degrees. The networks see upright "
          "people")
      ->check(CLI::Range(-360.0, 360.0));
  add_frame_limits(*command, options->limits);
  command->footer(
      "Writes for each image, in the DensePose convention:\n"
      "  <stem>_IUV.png   body part I, U * 255, V * 255 (channels B, G, R of the file)\n"
      "  <stem>_INDS.png  index of the person a pixel belongs to, from 1; 0: background\n"
      "  <stem>.json      boxes in pixels, scores, ids; with --keypoints also keypoints: x, y, confidence\n"
      "Frames of a clip are named <stem>_<frame number>. Files are written atomically.\n\n"
      "Examples:\n"
      "  maquette densepose photo.jpg --out results --overlay\n"
      "  maquette densepose holiday/*.jpg --out results --preset stream\n"
      "  maquette densepose photo.jpg --out results --overlay --keypoints\n"
      "  maquette densepose lying_phone.jpg --out results --roll 90\n"
      "  maquette densepose 'video:dance.mp4?fps=10' --out results --overlay\n"
      "  maquette densepose 'stub:people?count=3&seed=7' --out results --overlay --max-frames 60");
  command->callback([=] { *exit_code = run_densepose(*options); });
}
