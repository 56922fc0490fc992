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

// True unless a variable names a folder without networks.
bool print_networks() {
  bool are_there = true;
  const char* heading = "Networks";
  for (const SystemNetworks& networks : networks_of_build()) {
    const std::string bundle = default_bundle(networks);
    std::error_code error;
    std::string text = bundle.empty() ? "not installed; a command that needs them says how to install them" : bundle;
    if (!bundle.empty() && !std::filesystem::exists(std::filesystem::u8path(bundle) / "manifest.json", error)) {
      text = "missing: " + bundle + " has no manifest.json; see " + networks.variable;
      are_there = false;
    }
    print_output("%-14s %-10s  %s\n", heading, networks.system, text.c_str());
    heading = "";
  }
  return are_there;
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
  return print_networks() ? exit_code : 1;
}

}  // namespace

void add_info_command(CLI::App& app, int* exit_code) {
  CLI::App* command = app.add_subcommand(
      "info", "Print the versions, the systems in this build, and the paths of ONNX Runtime and the networks");
  command->callback([=] { *exit_code = print_info(); });
}
