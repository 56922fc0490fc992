#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands/head/head_commands.h"
#include "output/output_file.h"
#include "print.h"
#include "program.h"

namespace {

struct HeadInfoOptions {
  std::string path;
  bool json = false;
};

const char* name_of_scale(maq_head_scale scale) {
  return scale == MAQ_HEAD_SCALE_GIVEN ? "given" : scale == MAQ_HEAD_SCALE_DEPTH ? "depth" : "prior";
}

int show_head(const HeadInfoOptions& options) {
  const maquette::Context context = open_context();
  const maquette::Head head = maquette::Head::open(context, options.path);
  const maq_head_info info = head.info();
  if (options.json) {
    nlohmann::ordered_json places = nlohmann::ordered_json::object();
    for (const std::string& name : head.landmark_names()) {
      const maq_head_landmark place = head.landmark(name);
      places[name] = {{"point_m", place.point_m}, {"sigma_m", place.sigma_m}};
    }
    print_output("%s\n", json_text({{"head", options.path},
                                    {"photos", info.photo_count},
                                    {"scale", name_of_scale(info.scale)},
                                    {"scale_sigma", info.scale_sigma},
                                    {"landmarks", places}},
                                   2)
                             .c_str());
    return 0;
  }
  print_output("%s\n  photos     %u\n  size       %s\n", options.path.c_str(), info.photo_count,
               text_of_scale(info).c_str());
  if (const double distance_m = pupil_distance_m(head); distance_m > 0) {
    print_output("  pupils     %.1f mm apart\n", 1e3 * distance_m);
  }
  if (info.landmark_count > 0) print_output("  landmarks  mm to the person's left, to the back, up; give or take\n");
  for (const std::string& name : head.landmark_names()) {
    const maq_head_landmark place = head.landmark(name);
    print_output("    %-18s %7.1f %7.1f %7.1f  %.1f\n", name.c_str(), 1e3 * place.point_m[0], 1e3 * place.point_m[1],
                 1e3 * place.point_m[2], 1e3 * double(place.sigma_m));
  }
  return 0;
}

}  // namespace

std::string text_of_scale(const maq_head_info& info) {
  std::string text = info.scale == MAQ_HEAD_SCALE_GIVEN   ? "from a distance that was given"
                     : info.scale == MAQ_HEAD_SCALE_DEPTH ? "from depth"
                                                          : "as heads are on average";
  if (info.scale_sigma > 0) {
    char percent[32];
    std::snprintf(percent, sizeof percent, ", give or take %.2g %%", 100 * double(info.scale_sigma));
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
  command->add_flag("--json", options->json, "Print it as JSON, in metres");
  command->callback([=] { *exit_code = show_head(*options); });
}
