#include "arguments/densepose_options.h"

#include <CLI/CLI.hpp>
#include <maquette/maquette.hpp>
#include <stdexcept>

#include "arguments/bundle_argument.h"

void add_model_options(CLI::App& command, ModelOptions& options) {
  add_network_options(command, options, "MAQ_BUNDLE");
  command
      .add_option(
          "--preset", options.preset,
          "photo: everybody is mapped again in a crop of 256 pixels, with better parts and outlines in two to three "
          "times the time. stream: fast. Default: photo for images, stream for clips and cameras")
      ->check(CLI::IsMember({"photo", "stream"}));
  command
      .add_option("--size", options.size,
                  "Long side of the network's input in pixels (default: 288, and 480 as well where people are small)")
      ->check(CLI::Range(32, 2048));
  command.add_option("--threshold", options.threshold, "Minimum score of a person")->check(CLI::Range(0.0f, 1.0f));
  command
      .add_option("--max-proposals", options.max_proposals,
                  "Maximum number of boxes for the box head; fewer are faster and may miss people in a crowd")
      ->check(CLI::Range(1, 1000));
  command
      .add_option("--key-frames", options.key_frames,
                  "Detect people in every N-th frame of a stream, and propagate their boxes in between (default 1)")
      ->check(CLI::Range(1, 1000));
  command
      .add_option("--min-person-height", options.min_person_height_px,
                  "People less tall than N pixels may be missed; large values are faster")
      ->check(CLI::Range(0, 100000));
  command
      .add_option(
          "--crops", options.crops,
          "Map people a second time, in upright crops of the frame: off (streams), auto (people who are small or "
          "lean), all (photos). Finer and slower")
      ->check(CLI::IsMember({"off", "auto", "all"}));
  command.add_option("--crop-size", options.crop_px, "Side of a crop in pixels (default 192, of photos 256)")
      ->check(CLI::Range(64, 512));
  command.add_flag("--keypoints", options.keypoints,
                   "Also find 33 keypoints of each person, as MediaPipe Pose has them");
  command.add_flag("--no-surface", options.no_surface, "Compute only body parts: faster; U and V stay 0");
}

std::string bundle_of(const ModelOptions& options) { return bundle_or_default(kDenseposeNetworks, options.bundle); }

maq_densepose_config config_of(const ModelOptions& options, const std::string& bundle, bool is_photo) {
  maq_densepose_config config = maquette::default_densepose_config();
  config.model.bundle_path = bundle.c_str();
  config.model.threads = options.threads;
  if (!options.preset.empty()) is_photo = options.preset == "photo";
  config.preset = is_photo ? MAQ_DENSEPOSE_PRESET_PHOTO : MAQ_DENSEPOSE_PRESET_STREAM;
  config.long_side_px = options.size;
  config.score_threshold = options.threshold;
  config.max_proposals = options.max_proposals;
  config.key_frame_interval = options.key_frames;
  config.min_person_height_px = options.min_person_height_px;
  config.detail = options.no_surface ? MAQ_DENSEPOSE_DETAIL_PART : MAQ_DENSEPOSE_DETAIL_SURFACE;
  config.person_crops = options.crops == "auto"  ? MAQ_DENSEPOSE_CROPS_AUTO
                        : options.crops == "all" ? MAQ_DENSEPOSE_CROPS_ALL
                        : options.crops == "off" ? MAQ_DENSEPOSE_CROPS_OFF
                                                 : MAQ_DENSEPOSE_CROPS_DEFAULT;
  config.person_crop_px = options.crop_px;
  config.has_keypoints = options.keypoints ? 1 : 0;
  config.model.provider = provider_of(options);
  return config;
}
