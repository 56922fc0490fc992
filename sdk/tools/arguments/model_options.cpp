#include "arguments/model_options.h"

#include <CLI/CLI.hpp>
#include <map>
#include <maquette/maquette.hpp>

namespace {

const std::map<std::string, maq_provider> kProviders = {
    {"cpu", MAQ_PROVIDER_CPU}, {"xnnpack", MAQ_PROVIDER_XNNPACK}, {"nnapi", MAQ_PROVIDER_NNAPI}};

// A number, or "measured".
std::string read_threads(std::string& text) {
  if (text == "measured") {
    text = std::to_string(MAQ_THREADS_MEASURED);
    return {};
  }
  return CLI::Range(1, 64)(text).empty() ? std::string() : text + " is neither 1 to 64 nor \"measured\"";
}

}  // namespace

void add_network_options(CLI::App& command, NetworkOptions& options, const std::string& variable) {
  command.add_option("--bundle", options.bundle,
                     "Folder of the model bundle; default: " + variable + ", then the one installed with this program");
  command
      .add_option(
          "--threads", options.threads,
          "Threads of the networks, or \"measured\": the smallest number within 5 % of the fastest time; default: "
          "the large cores, at most 4")
      ->transform(CLI::Validator(read_threads, "1 to 64, or measured"));
  command
      .add_option("--provider", options.provider,
                  "Library that runs the networks' layers: cpu (default); xnnpack or nnapi if ONNX Runtime has them")
      ->check(CLI::IsMember(kProviders));
}

maq_provider provider_of(const NetworkOptions& options) { return kProviders.at(options.provider); }

const char* name_of(maq_provider provider) {
  for (const auto& [name, value] : kProviders) {
    if (value == provider) return name.c_str();
  }
  return "unknown";
}
