// The entry of libFuzzer and of driver.cpp. MAQ_FUZZ_TARGET names the target. With MAQ_FUZZ_SEEDS, the name of a
// folder, the seeds of all targets are written into it instead.
#include <filesystem>
#include <fstream>

#include "fuzz_target.h"

namespace fuzz {

std::vector<const Target*>& Target::all() {
  static std::vector<const Target*> targets;
  return targets;
}

Target::Target(const char* name_given, void (*run_given)(const Bytes&), std::vector<Bytes> (*seeds_given)())
    : name(name_given), run(run_given), seeds(seeds_given) {
  all().push_back(this);
}

}  // namespace fuzz

namespace {

const fuzz::Target& chosen() {
  static const fuzz::Target* const target = [] {
    const char* const name = std::getenv("MAQ_FUZZ_TARGET");
    for (const fuzz::Target* each : fuzz::Target::all()) {
      if (name != nullptr && name == std::string(each->name)) return each;
    }
    std::fprintf(stderr, "MAQ_FUZZ_TARGET must be one of:");
    for (const fuzz::Target* each : fuzz::Target::all()) std::fprintf(stderr, " %s", each->name);
    std::fprintf(stderr, "\n");
    std::exit(2);
  }();
  return *target;
}

// Small valid files of other tests, by target.
constexpr std::pair<const char*, const char*> kFiles[] = {
    {"head_file", "tiny_head/example.maqh"},
    {"head_file", "tiny_head/example_version_1.maqh"},
    {"prior_file", "tiny_head/priors/float16.maqp"},
    {"prior_file", "tiny_head/priors/float32.maqp"},
    {"prior_file", "tiny_head/priors/int8.maqp"},
    {"template_file", "tiny_head/template.maqt"},
    {"body_file", "tiny_body/body.maqb"},
    {"json", "tiny_head/bundle/manifest.json"},
    {"json", "tiny_scene/capture/transforms.json"},
    {"bundle", "tiny_bundle/manifest.json"},
    {"bundle", "tiny_edges/bundle/manifest.json"},
    {"bundle", "tiny_head/bundle/manifest.json"},
    {"bundle", "tiny_prediction/bundle/manifest.json"},
    {"bundle", "tiny_scene/bundle/manifest.json"},
    {"bundle", "tiny_transformer/bundle/manifest.json"},
    {"code_file", "tiny_prediction/bundle/codes.maqc"},
    {"embedding_file", "tiny_transformer/bundle/transformer.maqr"},
    {"embedding_file", "tiny_transformer/rows_in_bytes.maqr"},
    {"surface_files", "tiny_bundle/charts.f32"},
    {"nut", "clips/test_pattern.nut"},
    {"ply", "tiny_scene/capture/cloud.ply"},
    {"ply", "curves/example.ply"},
    {"transforms", "tiny_scene/capture/transforms.json"},
};

void write_seeds(const std::filesystem::path& folder) {
  std::filesystem::remove_all(folder);
  for (const fuzz::Target* target : fuzz::Target::all()) std::filesystem::create_directories(folder / target->name);
  int number = 0;
  for (const auto& [target, file] : kFiles) {
    std::filesystem::copy_file(MAQ_TEST_DATA + std::string("/") + file, folder / target / std::to_string(number++));
  }
  for (const fuzz::Target* target : fuzz::Target::all()) {
    if (target->seeds == nullptr) continue;
    for (const fuzz::Bytes& seed : target->seeds()) {
      std::ofstream file(folder / target->name / std::to_string(number++), std::ios::binary);
      file.write(reinterpret_cast<const char*>(seed.data()), std::streamsize(seed.size()));
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  if (const char* const folder = std::getenv("MAQ_FUZZ_SEEDS")) {
    write_seeds(folder);
    std::exit(0);
  }
  chosen();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  chosen().run({data, data + size});
  return 0;
}
