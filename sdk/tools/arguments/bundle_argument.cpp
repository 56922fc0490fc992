#include "arguments/bundle_argument.h"

#include <cstdlib>
#include <filesystem>

namespace fs = std::filesystem;

namespace {

std::string bundle_of(const char* variable, const char* name) {
  if (const char* from_environment = std::getenv(variable)) {
    if (*from_environment != '\0') return from_environment;
  }
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return "";
  const fs::path bundle = program.parent_path().parent_path() / "share/maquette/models" / name;
  return fs::exists(bundle / "manifest.json", error) ? bundle.string() : "";
}

}  // namespace

std::string default_bundle() { return bundle_of("MAQ_BUNDLE", "densepose-b-int8"); }

std::string default_edges_bundle() { return bundle_of("MAQ_EDGES_BUNDLE", "edges-int8"); }

std::string default_heads_bundle() { return bundle_of("MAQ_HEADS_BUNDLE", "heads-int8"); }

std::string default_prediction_bundle() { return bundle_of("MAQ_PREDICTION_BUNDLE", "prediction-int8"); }

std::string default_scene_bundle() { return bundle_of("MAQ_SCENE_BUNDLE", "scenes-int8"); }
