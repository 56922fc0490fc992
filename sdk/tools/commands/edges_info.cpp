#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "arguments/bundle_argument.h"
#include "commands/edges_commands.h"
#include "output/output_file.h"
#include "print.h"
#include "program.h"

namespace fs = std::filesystem;

namespace {

struct InfoOptions {
  std::string bundle;
  bool json = false;
};

// Reads the manifest of a bundle that the library has checked.
nlohmann::ordered_json describe(const std::string& bundle) {
  std::ifstream file(fs::u8path(bundle) / "manifest.json");
  const nlohmann::ordered_json manifest = nlohmann::ordered_json::parse(file);
  uint64_t bytes = 0;
  for (const auto& entry : manifest.at("files")) bytes += entry.at("bytes").get<uint64_t>();
  nlohmann::ordered_json document = {{"bundle", bundle}, {"bytes", bytes}};
  for (const char* key : {"name", "version", "precision", "field", "licence", "training_data", "measured"}) {
    if (manifest.contains(key)) document[key] = manifest.at(key);
  }
  return document;
}

void print(const nlohmann::ordered_json& document) {
  const auto text = [&](const char* key) { return document.at(key).get<std::string>(); };
  print_output("%s\n", text("bundle").c_str());
  print_output("  network    %s %s, %s, %.2f MB\n", text("name").c_str(), text("version").c_str(),
               text("precision").c_str(), double(document.at("bytes").get<uint64_t>()) / 1e6);
  print_output("  distances  up to %g r, a footprint: depth / focal length\n",
               document.at("field").at("eps_r").get<double>());
  print_output("  licence    %s\n", text("licence").c_str());
  const auto measured = document.find("measured");
  if (measured != document.end() && measured->contains("int8_cost")) {
    for (const auto& [noise, figures] : measured->at("int8_cost").items()) {
      print_output("  error      %.2f r (root mean square) on solids it was not trained on, %s depth\n",
                   figures.at("rmse_r_int8").get<double>(), noise.c_str());
    }
  }
}

int show(const InfoOptions& options) {
  const std::string bundle = bundle_or_default(kEdgesNetworks, options.bundle);
  const maquette::Context context = open_context();
  const maquette::Edges checked(context, bundle);
  const nlohmann::ordered_json document = describe(bundle);
  if (options.json) {
    print_output("%s\n", json_text(document, 2).c_str());
  } else {
    print(document);
  }
  return 0;
}

}  // namespace

void add_edges_info_command(CLI::App& edges, int* exit_code) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App* command = edges.add_subcommand("info", "Check the network and print its name, size, licence and errors");
  command->add_option("--bundle", options->bundle,
                      "Folder of the network; default: MAQ_EDGES_BUNDLE, then the installed bundle");
  command->add_flag("--json", options->json, "Print the information as JSON");
  command->callback([=] { *exit_code = show(*options); });
}
