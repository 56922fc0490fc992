#include <CLI/CLI.hpp>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <string>

#include "arguments/bundle_argument.h"
#include "commands/commands.h"
#include "print.h"

namespace {

std::string systems() {
  std::string names;
  const auto add = [&](bool is_in, const char* name) {
    if (is_in) names += (names.empty() ? "" : ", ") + std::string(name);
  };
  add(MAQ_HAS_DENSEPOSE, "densepose");
  add(MAQ_HAS_SCENES, "scenes");
  add(MAQ_HAS_EDGES, "edges");
  add(MAQ_HAS_HEADS, "heads");
  add(MAQ_HAS_PREDICTION, "prediction");
  return names.empty() ? "none: cameras, files and pipelines" : names;
}

int print_info() {
  print_output("Maquette       %s (commit %s)\n", maq_get_sdk_version(), maq_get_git_commit());
  print_output("Build          %s\n", maq_get_build_options());
  const maquette::Context context;
  int exit_code = 0;
  try {
    const std::string version = context.onnxruntime_version();
    print_output("ONNX Runtime   %s, %s\n", version.c_str(), context.onnxruntime_path().c_str());
  } catch (const maquette::Error& error) {
    print_output("ONNX Runtime   missing: %s\n", error.what());
    exit_code = 1;
  }
  print_output("Systems        %s\n", systems().c_str());
#if MAQ_HAS_DENSEPOSE
  const std::string bundle = default_bundle();
  std::error_code error;
  if (bundle.empty()) {
    print_output("Model bundle   missing: none was found; give one with --bundle or MAQ_BUNDLE\n");
    exit_code = 1;
  } else if (!std::filesystem::exists(std::filesystem::path(bundle) / "manifest.json", error)) {
    print_output("Model bundle   missing: %s has no manifest.json; see MAQ_BUNDLE\n", bundle.c_str());
    exit_code = 1;
  } else {
    print_output("Model bundle   %s\n", bundle.c_str());
  }
#endif
  return exit_code;
}

}  // namespace

void add_info_command(CLI::App& app, int* exit_code) {
  CLI::App* command = app.add_subcommand(
      "info", "Print the versions, the systems in this build, and the paths of ONNX Runtime and the model bundle");
  command->callback([=] { *exit_code = print_info(); });
}
