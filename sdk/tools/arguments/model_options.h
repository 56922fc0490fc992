// Options of the commands that run networks: the bundle, and the threads and the provider that run it.
#pragma once

#include <maquette/maquette.h>
#include <string>

namespace CLI {
class App;
}

struct NetworkOptions {
  std::string bundle;
  int threads = 0;  // or MAQ_THREADS_MEASURED
  std::string provider = "cpu";
};

// `variable`: of the environment, where the bundle is without --bundle.
void add_network_options(CLI::App& command, NetworkOptions& options, const std::string& variable);

maq_provider provider_of(const NetworkOptions& options);

// The name as --provider takes it.
const char* name_of(maq_provider provider);
