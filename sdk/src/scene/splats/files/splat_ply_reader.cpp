#include <algorithm>
#include <cmath>

#include "scene/capture/ply_numbers.h"
#include "scene/point_cloud.h"
#include "scene/splats/files/splat_files.h"

namespace maq {
namespace {

// The places of a splat's numbers in a row, by the order in which they are read into it.
enum SplatSlot : int {
  kSlotPosition = 0,
  kSlotColour = 3,
  kSlotOpacity = 6,
  kSlotScale = 7,
  kSlotRotation = 10,
  kSlotHarmonics = 14,
  kSlots = kSlotHarmonics + 3 * kMaxShTerms
};

constexpr double kFlatLogScale = -20;  // of the missing axis of flat splats

struct SplatLayout {
  std::vector<int> slots;  // of each property; -1: skipped
  int sh_degree = 0;
  bool is_flat = false;
};

[[noreturn]] void refuse_ply_of_points(const FileReader& file, const char* missing) {
  throw Error(MAQ_ERROR_UNSUPPORTED, file.path(), " is a PLY file without splats: its vertices have no \"", missing,
              "\". Build a scene of a point cloud with photos (maq_scene_build), or give a file of splats.");
}

SplatLayout splat_layout(const PlyElement& vertex, const FileReader& file) {
  if (vertex.index_of("packed_position") >= 0) {
    throw Error(MAQ_ERROR_UNSUPPORTED, file.path(),
                " is a compressed PLY file of splats; convert it, for example by: splat-transform IN.ply OUT.spz.");
  }
  SplatLayout layout;
  layout.slots.assign(vertex.properties.size(), -1);
  const auto place = [&](const char* name, int slot) {
    const int index = vertex.index_of(name);
    if (index >= 0) layout.slots[size_t(index)] = slot;
    return index >= 0;
  };
  const char* const kNames[] = {"x",       "y",       "z",       "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
                                "scale_0", "scale_1", "scale_2", "rot_0",  "rot_1",  "rot_2",  "rot_3"};
  for (int slot = 0; slot < kSlotHarmonics; ++slot) {
    if (place(kNames[slot], slot)) continue;
    if (slot != kSlotScale + 2) refuse_ply_of_points(file, kNames[slot]);
    layout.is_flat = true;
  }
  int rest = 0;
  while (rest < 3 * kMaxShTerms && vertex.index_of("f_rest_" + std::to_string(rest)) >= 0) ++rest;
  for (int degree = 1; degree <= kMaxShDegree; ++degree) {
    if (rest >= 3 * sh_terms(degree)) layout.sh_degree = degree;
  }
  // All of red, then green, then blue.
  const int terms = sh_terms(layout.sh_degree);
  if (rest != 3 * terms || vertex.index_of("f_rest_" + std::to_string(rest)) >= 0) {
    throw Error(MAQ_ERROR_UNSUPPORTED, file.path(), " has ", rest,
                " or more properties \"f_rest_\" a splat; 0, 9, 24 and 45 are supported.");
  }
  for (int i = 0; i < rest; ++i) {
    place(("f_rest_" + std::to_string(i)).c_str(), kSlotHarmonics + 3 * (i % terms) + i / terms);
  }
  return layout;
}

double logistic(double value) { return 1 / (1 + std::exp(-value)); }

Splat splat_of_row(const double* row) {
  Splat splat;
  for (size_t i = 0; i < 3; ++i) {
    splat.position[i] = row[kSlotPosition + i];
    splat.colour[i] = float(0.5 + double(kShConstant) * row[kSlotColour + i]);
    splat.scale[i] = float(std::exp(row[kSlotScale + i]));
  }
  for (size_t i = 0; i < 4; ++i) splat.rotation[i] = float(row[kSlotRotation + i]);
  splat.opacity = float(logistic(row[kSlotOpacity]));
  return splat;
}

}  // namespace

Splats read_splat_ply(const std::string& path) {
  FileReader file(path);
  const PlyHeader header = read_ply_header(file);
  PlyNumbers numbers(file, header.form);
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                   [](const PlyElement& element) { return element.name == "vertex"; });
  if (vertex == header.elements.end()) file.fail(" has no vertices, so it has no splats.");
  const SplatLayout layout = splat_layout(*vertex, file);
  for (auto element = header.elements.begin(); element != vertex; ++element) {
    skip_ply_element(*element, header.form, numbers, file);
  }
  check_ply_count(*vertex, header.form, file);
  if (vertex->count > kMaxPoints) {
    throw Error(MAQ_ERROR_UNSUPPORTED, path, " has ", vertex->count, " splats, over the limit of ", kMaxPoints,
                "; make it smaller.");
  }
  Splats splats;
  splats.sh_degree = layout.sh_degree;
  for (const std::string& comment : header.comments) {
    if (comment == "SplatRenderMode: mip" || comment == "antialiased 1") splats.is_antialiased = true;
  }
  splats.reserve(size_t(vertex->count));
  const int terms = sh_terms(layout.sh_degree);
  double row[kSlots] = {};
  if (layout.is_flat) row[kSlotScale + 2] = kFlatLogScale;
  for (uint64_t i = 0; i < vertex->count; ++i) {
    for (size_t k = 0; k < layout.slots.size(); ++k) {
      const PlyProperty& property = vertex->properties[k];
      if (property.is_list || layout.slots[k] < 0) {
        numbers.skip(property);
      } else {
        row[layout.slots[k]] = numbers.next(property.type);
      }
    }
    if (!splats.add(splat_of_row(row))) continue;
    for (int k = 0; k < 3 * terms; ++k) splats.sh.push_back(sh_steps(row[kSlotHarmonics + k]));
  }
  if (splats.count() == 0) file.fail(" has no splat with finite numbers, so there is nothing to show.");
  return splats;
}

}  // namespace maq
