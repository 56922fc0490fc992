#include "commands/body/body_text.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "output/output_file.h"
#include "print.h"
#include "program.h"

namespace {

using Json = nlohmann::ordered_json;

struct NamedSize {
  const char* name;
  maq_body_size maq_body_sizes::*size;
};

constexpr NamedSize kNamedSizes[] = {{"height", &maq_body_sizes::height},
                                     {"chest", &maq_body_sizes::chest},
                                     {"waist", &maq_body_sizes::waist},
                                     {"hip", &maq_body_sizes::hip},
                                     {"inseam", &maq_body_sizes::inseam}};

Json angles_of(const maq_body_person& person) {
  Json angles = Json::object();
  for (int32_t i = 0; i < MAQ_BODY_ANGLE_COUNT; ++i) {
    angles[maq_body_get_angle_name(i)] = std::round(10 * double(person.angles_deg[i])) / 10;
  }
  return angles;
}

Json json_of_sizes(const maq_body_sizes& sizes) {
  const auto rounded = [](float metres) { return std::round(1000 * double(metres)) / 1000; };
  Json made = {{"is_height_known", sizes.is_height_known != 0}};
  for (const NamedSize& named : kNamedSizes) {
    const maq_body_size& size = sizes.*named.size;
    made[named.name] = {{"value", rounded(size.value_m)}, {"low", rounded(size.low_m)}, {"high", rounded(size.high_m)}};
  }
  return made;
}

std::string centimetres(const maq_body_size& size) {
  char text[64];
  if (size.low_m < size.high_m) {
    std::snprintf(text, sizeof text, "%.0f (%.0f to %.0f)", 100 * double(size.value_m), 100 * double(size.low_m),
                  100 * double(size.high_m));
  } else {
    std::snprintf(text, sizeof text, "%.0f", 100 * double(size.value_m));
  }
  return text;
}

}  // namespace

std::string json_of_frame(const std::string& stem, const maq_frame_desc& desc,
                          const std::vector<maq_body_person>& people, const maquette::BodyResult& fitted) {
  Json list = Json::array();
  for (uint32_t i = 0; i < people.size(); ++i) {
    const maq_body_person& person = people[i];
    Json item = {{"id", person.id}, {"is_fitted", person.fit == MAQ_BODY_FIT_FITTED}};
    if (person.fit == MAQ_BODY_FIT_FITTED) {
      item["pelvis_px"] = person.pelvis_px;
      item["scale_px_per_m"] = person.scale_px_per_m;
      item["error_px"] = person.error_px;
      item["angles_deg"] = angles_of(person);
      item["sizes_m"] = json_of_sizes(fitted.sizes(i));
      item["keypoints_m"] = std::vector<float>(person.keypoints_m, person.keypoints_m + 3 * MAQ_BODY_KEYPOINT_COUNT);
    }
    list.push_back(item);
  }
  return json_text({{"frame", stem}, {"timestamp_ns", desc.timestamp_ns}, {"people", list}});
}

void print_angles(const std::vector<maq_body_person>& people) {
  for (const maq_body_person& person : people) {
    if (person.fit != MAQ_BODY_FIT_FITTED) continue;
    print_output("person %lld  %s\n", (long long)person.id, angles_of(person).dump().c_str());
  }
}

void print_sizes(const SizesOfPeople& sizes) {
  if (sizes.empty()) return;
  const bool is_known = sizes.begin()->second.is_height_known != 0;
  print_output("%-8s", "size, cm");
  for (const NamedSize& named : kNamedSizes) print_output("  %-17s", named.name);
  print_output("%s\n", is_known ? "" : "  (--height narrows the intervals)");
  for (const auto& [id, of] : sizes) {
    print_output("%-8lld", (long long)id);
    for (const NamedSize& named : kNamedSizes) print_output("  %-17s", centimetres(of.*named.size).c_str());
    print_output("\n");
  }
}
