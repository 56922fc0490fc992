// Options of the commands that run dense pose.
#pragma once

#include "arguments/model_options.h"

struct ModelOptions : NetworkOptions {
  int size = 0;
  float threshold = 0;
  int max_proposals = 0;
  int key_frames = 0;
  int min_person_height_px = 0;
  std::string preset;  // empty: by the source
  std::string crops;   // empty: the preset's
  int crop_px = 0;
  bool no_surface = false;
  bool keypoints = false;
};

void add_model_options(CLI::App& command, ModelOptions& options);

// The folder of the bundle that was named, or else of the default one. Throws std::runtime_error without any.
std::string bundle_of(const ModelOptions& options);

// `bundle` must outlive the configuration. `is_photo`: the preset where none was named.
maq_densepose_config config_of(const ModelOptions& options, const std::string& bundle, bool is_photo = false);
