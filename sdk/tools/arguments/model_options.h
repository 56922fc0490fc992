// Options of the commands that run networks: which bundle, what runs it, and for people what may be left out.
#pragma once

#include <maquette/maquette.h>
#include <string>

namespace CLI {
class App;
}

struct NetworkOptions {
  std::string bundle;
  int threads = 0;  // or MAQ_THREADS_MEASURED
  bool no_spin = false;
  std::string provider = "cpu";
};

// `variable`: of the environment, where the bundle is without --bundle.
void add_network_options(CLI::App& command, NetworkOptions& options, const std::string& variable);

maq_provider provider_of(const NetworkOptions& options);

struct ModelOptions : NetworkOptions {
  int size = 0;
  float threshold = 0;
  int max_proposals = 0;
  int key_frames = 0;
  int min_person_height_px = 0;
  std::string crops = "off";
  int crop_px = 0;
  bool no_surface = false;
};

void add_model_options(CLI::App& command, ModelOptions& options);

// The folder of the bundle that was named, or else of the default one. Throws std::runtime_error without any.
std::string bundle_of(const ModelOptions& options);

// As --provider has it.
const char* name_of(maq_provider provider);

// `bundle` must outlive the configuration.
maq_densepose_config config_of(const ModelOptions& options, const std::string& bundle);
