#include <CLI/CLI.hpp>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <string>
#include <vector>

#include "arguments/bundle_argument.h"
#include "arguments/densepose_options.h"
#include "commands/body/body_text.h"
#include "commands/commands.h"
#include "commands/source_frames.h"
#include "output/output_file.h"
#include "print.h"
#include "program.h"

namespace fs = std::filesystem;

namespace {

struct BodyOptions {
  std::string source, out, bvh, bundle;
  ModelOptions model;
  double focal_px = 0, height_m = 0;
  bool json = false;
  FrameLimits limits;
};

struct BodyCounts {
  int64_t frames = 0, fitted = 0, not_fitted = 0;
};

// `path` for the first person; with the number of the person before the extension for others.
std::string path_of_person(const std::string& path, uint32_t index) {
  if (index == 0) return path;
  const fs::path whole = fs::u8path(path);
  fs::path name = whole.stem();
  name += "_" + std::to_string(index + 1);
  name += whole.extension();
  return (whole.parent_path() / name).u8string();
}

void write_files(const BodyOptions& options, maquette::BodyClip& clip, const BodyCounts& counts) {
  if (clip.person_count() == 0) {
    throw std::runtime_error("No body was fitted in " + std::to_string(counts.frames) +
                             " frames, so nothing was written; people must be seen from head to hip at least.");
  }
  const auto report = [&](const std::string& path) {
    if (!options.json) print_output("  -> %s\n", path.c_str());
  };
  if (!options.json) {
    print_output("%lld frame%s, %u %s, %lld bodies fitted, %lld not\n", (long long)counts.frames,
                 counts.frames == 1 ? "" : "s", clip.person_count(), clip.person_count() == 1 ? "person" : "people",
                 (long long)counts.fitted, (long long)counts.not_fitted);
  }
  if (!options.out.empty()) {
    make_folder_of(fs::u8path(options.out));
    clip.save(options.out);
    report(options.out);
  }
  if (options.bvh.empty()) return;
  make_folder_of(fs::u8path(options.bvh));
  for (uint32_t i = 0; i < clip.person_count(); ++i) {
    const std::string path = path_of_person(options.bvh, i);
    clip.save_person(i, path);
    report(path);
  }
}

int run_body(const BodyOptions& options) {
  if (options.out.empty() && options.bvh.empty() && !options.json) {
    throw std::runtime_error("Nothing is to be written: give --out body.glb, --bvh body.bvh or --json.");
  }
  const std::vector<SourceArgument> arguments = parse_sources({options.source});
  const std::string densepose_bundle = bundle_of(options.model);
  const std::string body_bundle = bundle_or_default(kBodyNetworks, options.bundle);
  const maquette::Context context = open_context();
  maq_body_config config = maquette::default_body_config();
  config.model.bundle_path = body_bundle.c_str();
  maquette::Body body(context, config);
  maquette::BodyClip clip(body);
  std::unique_ptr<maquette::DensePose> densepose;
  BodyCounts counts;
  SizesOfPeople sizes;
  const auto load = [&](const maquette::Source& source) {
    densepose =
        std::make_unique<maquette::DensePose>(context, config_of(options.model, densepose_bundle, !is_clip(source)));
  };
  const auto run = [&](const SourceArgument& argument, maquette::Source& source) {
    const bool is_photo = !is_clip(source);
    run_frames(argument, source, options.limits, options.json, [&](const SourceFrame& given) {
      maq_frame_desc desc = given.frame.desc();
      if (options.focal_px > 0) {
        desc.intrinsics = {desc.width_px,
                           desc.height_px,
                           options.focal_px,
                           options.focal_px,
                           0.5 * (desc.width_px - 1),
                           0.5 * (desc.height_px - 1),
                           {}};
      }
      const maquette::DensePoseResult found = densepose->run(given.frame);
      const std::vector<float> heights(found.people().size(), float(options.height_m));
      const maquette::BodyResult fitted = body.run(found, desc, heights);
      const std::vector<maq_body_person> people = fitted.people();
      ++counts.frames;
      for (uint32_t i = 0; i < people.size(); ++i) {
        const bool is_fitted = people[i].fit == MAQ_BODY_FIT_FITTED;
        ++(is_fitted ? counts.fitted : counts.not_fitted);
        if (is_fitted) sizes[people[i].id] = fitted.sizes(i);
      }
      clip.add(fitted);
      if (options.json) {
        print_output("%s\n", json_of_frame(given.stem, desc, people, fitted).c_str());
        flush_output();
      }
      if (is_photo && !options.json) print_angles(people);
      return std::to_string(people.size()) + " people";
    });
  };
  const int exit_code = run_sources(context, arguments, load, run);
  if (exit_code != 0 && counts.frames == 0) return exit_code;
  if (!options.json) print_sizes(sizes);
  if (!options.out.empty() || !options.bvh.empty()) write_files(options, clip, counts);
  return exit_code;
}

}  // namespace

void add_body_command(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<BodyOptions>();
  CLI::App* command =
      app.add_subcommand("body", "Fit a body to each person of a photo or clip: mesh, skeleton and motion");
  command->add_option("source", options->source, "Image, clip or URI: photo.jpg, clip.mp4, stub:people")->required();
  command->add_option("-o,--out", options->out,
                      "Bodies as glTF (.glb): a skinned mesh for each person, animated for clips");
  command->add_option("--bvh", options->bvh,
                      "Motion as BVH: the person with the most frames; others are written to <name>_2.bvh, ...");
  command->add_option("--body-bundle", options->bundle,
                      "Folder of the body bundle; default: MAQ_BODY_BUNDLE, then the installed one");
  command
      ->add_option("--focal-length", options->focal_px,
                   "Focal length of the camera in pixels. Without it and without a calibrated source, people are "
                   "seen in weak perspective")
      ->check(CLI::Range(10.0, 1e5));
  command
      ->add_option("--height", options->height_m,
                   "True height of the people in metres; sets the scale of all bodies. Without it, people have the "
                   "average height, and their sizes wide intervals")
      ->check(CLI::Range(1.3, 2.3));
  command->add_flag("--json", options->json, "Print angles, keypoints and sizes as one JSON line per frame");
  add_model_options(*command, options->model);
  add_frame_limits(*command, options->limits);
  command->footer(
      "A person keeps one shape for the whole clip. People are told apart by their ids.\n"
      "The table of sizes has the last frame of each person, with intervals that contain 90 % of true sizes.\n\n"
      "Examples:\n"
      "  maquette body dance.mp4 --out dance.glb --bvh dance.bvh\n"
      "  maquette body photo.jpg --out body.glb --height 1.78\n"
      "  maquette body walk.mp4 --json --focal-length 900");
  command->callback([=] { *exit_code = run_body(*options); });
}
