// Options of the commands that find people: which bundle, and what may be left out.
#pragma once

#include <maquette/maquette.h>
#include <string>

namespace CLI {
class App;
}

struct ModelOptions {
  std::string bundle;
  int size = 0;
  float threshold = -1;
  int threads = 0;
  int max_proposals = 0;
  int key_frames = 1;
  int min_person_height_px = 0;
  std::string crops = "off";
  int crop_px = 0;
  bool no_surface = false;
  bool no_spin = false;
  std::string provider = "cpu";
};

void add_model_options(CLI::App& command, ModelOptions& options);

// The folder of the bundle that was named, or else of the default one. Throws std::runtime_error without any.
std::string bundle_of(const ModelOptions& options);

// As --provider has it.
const char* name_of(maq_provider provider);

// `bundle` must outlive the configuration.
maq_densepose_config config_of(const ModelOptions& options, const std::string& bundle);
