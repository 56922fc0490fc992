#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "arguments/bundle_argument.h"
#include "commands/head/head_commands.h"
#include "output/output_file.h"
#include "print.h"
#include "program.h"

namespace {

struct HeadInfoOptions {
  std::string path, bundle;
  bool json = false;
};

// Counts of the template's mesh; 0 if the default bundle has no template.
struct TemplateFacts {
  uint32_t vertices = 0, triangles = 0, morph_targets = 0;
};

TemplateFacts template_facts(const maquette::Head& head, const std::string& named) {
  const std::string bundle = named.empty() ? default_bundle(kHeadsNetworks) : named;
  maq_head_mesh_config config = maquette::default_head_mesh_config();
  if (!bundle.empty()) config.model.bundle_path = bundle.c_str();
  try {
    const maquette::HeadMesh made(head, config);
    const maq_head_mesh_data mesh = made.data();
    return {mesh.vertex_count, mesh.triangle_count, mesh.morph_target_count};
  } catch (const maquette::Error& error) {
    const bool is_missing = error.status() == MAQ_ERROR_UNSUPPORTED || error.status() == MAQ_ERROR_NOT_FOUND;
    if (!is_missing || !named.empty()) throw;
    return {};
  }
}

int show_head(const HeadInfoOptions& options) {
  const maquette::Context context = open_context();
  const maquette::Head head = maquette::Head::open(context, options.path);
  const maq_head_info info = head.info();
  const TemplateFacts of_template = template_facts(head, options.bundle);
  if (options.json) {
    nlohmann::ordered_json landmarks = nlohmann::ordered_json::object();
    for (const std::string& name : head.landmark_names()) {
      const maq_head_landmark landmark = head.landmark(name);
      landmarks[name] = {{"point_m", landmark.point_m}, {"sigma_m", landmark.sigma_m}};
    }
    print_output("%s\n", json_text({{"head", options.path},
                                    {"photos", info.photo_count},
                                    {"scale", name_of_scale(info.scale)},
                                    {"scale_sigma", info.scale_sigma},
                                    {"template",
                                     {{"vertices", of_template.vertices},
                                      {"triangles", of_template.triangles},
                                      {"morph_targets", of_template.morph_targets}}},
                                    {"landmarks", landmarks}},
                                   2)
                             .c_str());
    return 0;
  }
  print_output("%s\n  photos     %u\n  size       %s\n", options.path.c_str(), info.photo_count,
               text_of_scale(info).c_str());
  if (const double distance_m = pupil_distance_m(head); distance_m > 0) {
    print_output("  pupils     %.1f mm apart\n", 1e3 * distance_m);
  }
  if (of_template.vertices > 0) {
    print_output("  template   %u vertices, %u triangles, %u morph targets\n", of_template.vertices,
                 of_template.triangles, of_template.morph_targets);
  } else {
    print_output("  template   none: the installed bundle has none, see --bundle\n");
  }
  if (info.landmark_count > 0)
    print_output("  landmarks  mm to the person's left, up, to the front; standard deviation\n");
  for (const std::string& name : head.landmark_names()) {
    const maq_head_landmark landmark = head.landmark(name);
    print_output("    %-18s %7.1f %7.1f %7.1f  %.1f\n", name.c_str(), 1e3 * landmark.point_m[0],
                 1e3 * landmark.point_m[1], 1e3 * landmark.point_m[2], 1e3 * double(landmark.sigma_m));
  }
  return 0;
}

}  // namespace

const char* name_of_scale(maq_head_scale scale) {
  return scale == MAQ_HEAD_SCALE_GIVEN ? "given" : scale == MAQ_HEAD_SCALE_DEPTH ? "depth" : "prior";
}

std::string text_of_scale(const maq_head_info& info) {
  std::string text = info.scale == MAQ_HEAD_SCALE_GIVEN   ? "from a given distance"
                     : info.scale == MAQ_HEAD_SCALE_DEPTH ? "from depth"
                                                          : "the average of heads";
  if (info.scale_sigma > 0) {
    char percent[32];
    std::snprintf(percent, sizeof percent, ", +- %.2g %%", 100 * double(info.scale_sigma));
    text += percent;
  }
  return text;
}

double pupil_distance_m(const maquette::Head& head) {
  maq_head_landmark left{}, right{};
  left.struct_size = right.struct_size = sizeof left;
  if (maq_head_get_landmark(head.get(), "pupil_left", &left) != MAQ_OK ||
      maq_head_get_landmark(head.get(), "pupil_right", &right) != MAQ_OK) {
    return 0;
  }
  return std::hypot(left.point_m[0] - right.point_m[0], left.point_m[1] - right.point_m[1],
                    left.point_m[2] - right.point_m[2]);
}

void add_head_info_command(CLI::App& head, int* exit_code) {
  auto options = std::make_shared<HeadInfoOptions>();
  CLI::App* command = head.add_subcommand("info", "Check a saved head and print its size and landmarks");
  command->add_option("head", options->path, "File that `maquette head --save` wrote")->required();
  command->add_option("--bundle", options->bundle,
                      "Folder of the bundle with the template head; default: MAQ_HEADS_BUNDLE, then the installed one");
  command->add_flag("--json", options->json, "Print the information as JSON, in metres");
  command->callback([=] { *exit_code = show_head(*options); });
}
