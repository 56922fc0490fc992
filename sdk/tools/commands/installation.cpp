#include "commands/installation.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace fs = std::filesystem;

namespace {

[[maybe_unused]] void use_bundle(maq_model_options& model, const std::string& bundle) {
  model.bundle_path = bundle.c_str();
  model.threads = 1;
}

// Throws the library's sentence about networks that it cannot read.
void load_networks([[maybe_unused]] const maquette::Context& context, const SystemNetworks& networks,
                   [[maybe_unused]] const std::string& bundle) {
  [[maybe_unused]] const std::string system = networks.system;
#if MAQ_HAS_DENSEPOSE
  if (system == kDenseposeNetworks.system) {
    maq_densepose_config config = maquette::default_densepose_config();
    use_bundle(config.model, bundle);
    const maquette::DensePose loaded(context, config);
  }
#endif
#if MAQ_HAS_SCENES
  if (system == kScenesNetworks.system) {
    maq_scene_build_config config = maquette::default_scene_build_config();
    use_bundle(config.model, bundle);
    const float point[3] = {};
    const maq_point_cloud cloud{sizeof cloud, 1, point, {0, 0, 0}, {0, 0, 1}};
    maq_scene_builder* builder = nullptr;
    maquette::check(maq_scene_builder_create(context.get(), &config, &cloud, &builder));
    maq_scene_builder_destroy(builder);
  }
#endif
#if MAQ_HAS_EDGES
  if (system == kEdgesNetworks.system) {
    maq_edges_config config = maquette::default_edges_config();
    use_bundle(config.model, bundle);
    const maquette::Edges loaded(context, config);
  }
#endif
#if MAQ_HAS_HEADS
  if (system == kHeadsNetworks.system) {
    maq_head_builder_config config = maquette::default_head_builder_config();
    use_bundle(config.model, bundle);
    const maquette::HeadBuilder loaded(context, config);
  }
#endif
#if MAQ_HAS_PREDICTION
  if (system == kPredictionNetworks.system) {
    maq_predictor_config config = maquette::default_predictor_config();
    use_bundle(config.model, bundle);
    config.method = MAQ_PREDICTOR_SAMPLED;
    const maquette::Predictor loaded(context, config);
  }
#endif
}

// Reads the manifest of a bundle that the library has checked.
void describe_networks(InstalledNetworks& found) {
  std::ifstream file(fs::path(found.path) / "manifest.json");
  const nlohmann::json manifest = nlohmann::json::parse(file);
  found.precision = manifest.at("precision").get<std::string>();
  for (const auto& entry : manifest.at("files")) found.bytes += entry.at("bytes").get<uint64_t>();
}

std::string path_of_program(const std::string& name) {
  if (name.find('/') != std::string::npos) return access(name.c_str(), X_OK) == 0 ? name : "";
  const char* const searched = std::getenv("PATH");
  std::istringstream folders(searched == nullptr ? "" : searched);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path path = fs::path(folder) / name;
    std::error_code error;
    if (fs::is_regular_file(path, error) && access(path.c_str(), X_OK) == 0) return path.string();
  }
  return "";
}

// Returns the first line that a program prints for `-version`; "" without any.
std::string version_line(const std::string& path) {
  std::string quoted = "'";
  for (const char letter : path) quoted += letter == '\'' ? "'\\''" : std::string(1, letter);
  std::FILE* const answer = popen((quoted + "' -version 2>/dev/null </dev/null").c_str(), "re");
  if (answer == nullptr) return "";
  char line[256] = "";
  if (std::fgets(line, sizeof line, answer) == nullptr) line[0] = '\0';
  while (std::fgetc(answer) != EOF) {
  }
  pclose(answer);
  line[std::strcspn(line, "\n")] = '\0';
  return line;
}

}  // namespace

InstalledNetworks find_networks(const maquette::Context& context, const SystemNetworks& networks) {
  InstalledNetworks found;
  found.path = default_bundle(networks);
  if (found.path.empty()) return found;
  try {
    load_networks(context, networks, found.path);
    describe_networks(found);
  } catch (const std::exception& error) {
    found.problem = error.what();
  }
  return found;
}

InstalledFfmpeg find_ffmpeg() {
  const char* const named = std::getenv("MAQ_FFMPEG");
  const std::string name = named != nullptr && *named != '\0' ? named : "ffmpeg";
  InstalledFfmpeg found;
  found.path = path_of_program(name);
  if (found.path.empty()) {
    found.problem = name == "ffmpeg" ? "the program ffmpeg is not in the PATH"
                                     : "MAQ_FFMPEG names " + name + ", which is no program";
    return found;
  }
  const std::string line = version_line(found.path);
  constexpr const char* kBegin = "ffmpeg version ";
  if (line.rfind(kBegin, 0) == 0) {
    found.version = line.substr(std::strlen(kBegin));
    found.version.resize(std::min(found.version.size(), found.version.find(' ')));
  } else {
    found.problem = found.path + " does not tell its version, so it is not ffmpeg or does not start";
  }
  return found;
}
