#include <CLI/CLI.hpp>
#include <cstdio>
#include <maquette/maquette.hpp>

#include "arguments/bundle_argument.h"
#include "commands/commands.h"

namespace {

int print_info() {
  std::printf("Maquette       %s (commit %s)\n", maq_get_sdk_version(), maq_get_git_commit());
  std::printf("Build          %s\n", maq_get_build_options());
  const maquette::Context context;
  int exit_code = 0;
  try {
    const std::string version = context.onnxruntime_version();
    std::printf("ONNX Runtime   %s, %s\n", version.c_str(), context.onnxruntime_path().c_str());
  } catch (const maquette::Error& error) {
    std::printf("ONNX Runtime   missing: %s\n", error.what());
    exit_code = 1;
  }
  const std::string bundle = default_bundle();
  std::printf("Model bundle   %s\n", bundle.empty() ? "none found; give one with --bundle" : bundle.c_str());
  return exit_code;
}

}  // namespace

void add_info_command(CLI::App& app, int* exit_code) {
  CLI::App* command =
      app.add_subcommand("info", "Print the versions, and the paths of ONNX Runtime and the model bundle");
  command->callback([=] { *exit_code = print_info(); });
}
