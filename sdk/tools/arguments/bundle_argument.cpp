#include "arguments/bundle_argument.h"

#include <cstdlib>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <stdexcept>

#include "own_program.h"

namespace fs = std::filesystem;

namespace {

// Returns where the bundle lies when it is installed with this program; "" where the system hides the program's path.
fs::path place_of(const SystemNetworks& networks) {
  const fs::path program = own_program_path();
  if (program.empty()) return {};
  return program.parent_path().parent_path() / "share/maquette/models" / networks.bundle;
}

}  // namespace

std::vector<SystemNetworks> networks_of_build() {
  std::vector<SystemNetworks> systems;
  const auto add = [&](bool is_in, const SystemNetworks& networks) {
    if (is_in) systems.push_back(networks);
  };
  add(MAQ_HAS_DENSEPOSE, kDenseposeNetworks);
  add(MAQ_HAS_SCENES, kScenesNetworks);
  add(MAQ_HAS_EDGES, kEdgesNetworks);
  add(MAQ_HAS_HEADS, kHeadsNetworks);
  add(MAQ_HAS_PREDICTION, kPredictionNetworks);
  add(MAQ_HAS_BODY, kBodyNetworks);
  return systems;
}

std::string default_bundle(const SystemNetworks& networks) {
  if (const char* from_environment = std::getenv(networks.variable)) {
    if (*from_environment != '\0') return from_environment;
  }
  std::error_code error;
  const fs::path place = place_of(networks);
  return !place.empty() && fs::exists(place / "manifest.json", error) ? place.string() : "";
}

std::string missing_networks(const SystemNetworks& networks) {
  return std::string("The networks of ") + networks.system + " are not installed: there is no " +
         (place_of(networks) / "manifest.json").string() + ", and " + networks.variable + " is not set.";
}

std::string advice_on_missing(const SystemNetworks& networks) {
  return std::string("Install them (Python: pip install 'maquette[") + networks.system +
         "]'; otherwise the package maquette-models), or set " + networks.variable +
         " to the folder of the bundle (in a checkout: sdk/models/" + networks.bundle + ").";
}

std::string bundle_or_default(const SystemNetworks& networks, const std::string& given) {
  const std::string bundle = given.empty() ? default_bundle(networks) : given;
  if (bundle.empty()) throw std::runtime_error(missing_networks(networks) + " " + advice_on_missing(networks));
  return bundle;
}
