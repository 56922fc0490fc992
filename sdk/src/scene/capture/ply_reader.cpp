#include "scene/capture/ply_reader.h"

#include <algorithm>
#include <cmath>

#include "scene/capture/ply_numbers.h"

namespace maq {
namespace {

// The use of each property of a vertex: 0 to 2: x, y, z; 3 to 5: red, green, blue; -1: none.
std::vector<int> uses_of(const PlyElement& vertex, const FileReader& file) {
  std::vector<int> uses(vertex.properties.size(), -1);
  const char* const positions[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) {
    const int index = vertex.index_of(positions[i]);
    if (index < 0) file.fail(" has vertices without \"", positions[i], "\", so they are not points.");
    uses[size_t(index)] = i;
  }
  for (const std::string prefix : {"", "diffuse_"}) {
    const int red = vertex.index_of(prefix + "red"), green = vertex.index_of(prefix + "green"),
              blue = vertex.index_of(prefix + "blue");
    if (red < 0 || green < 0 || blue < 0) continue;
    uses[size_t(red)] = 3;
    uses[size_t(green)] = 4;
    uses[size_t(blue)] = 5;
    break;
  }
  return uses;
}

// The factor that converts a colour of that integer type to 0 to 255.
double colour_scale(PlyType type) {
  switch (type) {
    case PlyType::kInt8: return 255.0 / 127;
    case PlyType::kInt16: return 255.0 / 32767;
    case PlyType::kUint16: return 255.0 / 65535;
    default: return 1;
  }
}

struct Vertices {
  PointCloud cloud;
  double brightest_float = 0;
};

Vertices read_vertices(const std::string& path, const std::array<double, 3>& origin, double float_scale,
                       ImportReport& report) {
  FileReader file(path);
  const PlyHeader header = read_ply_header(file);
  PlyNumbers numbers(file, header.form);
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                   [](const PlyElement& element) { return element.name == "vertex"; });
  if (vertex == header.elements.end()) file.fail(" has no vertices, so it is not a point cloud.");
  const std::vector<int> uses = uses_of(*vertex, file);
  for (auto element = header.elements.begin(); element != vertex; ++element) {
    skip_ply_element(*element, header.form, numbers, file);
  }
  check_ply_count(*vertex, header.form, file);
  if (vertex->count > kMaxPoints) {
    throw Error(MAQ_ERROR_UNSUPPORTED, path, " has ", vertex->count, " points, over the limit of ", kMaxPoints,
                "; thin it out.");
  }

  Vertices read;
  read.cloud.origin = origin;
  const bool has_colours = std::find(uses.begin(), uses.end(), 3) != uses.end();
  read.cloud.reserve(size_t(vertex->count), has_colours);
  size_t without_position = 0, without_colour = 0;
  for (uint64_t i = 0; i < vertex->count; ++i) {
    double values[6] = {};
    for (size_t k = 0; k < uses.size(); ++k) {
      const PlyProperty& property = vertex->properties[k];
      if (property.is_list || uses[k] < 0) {
        numbers.skip(property);
        continue;
      }
      double value = numbers.next(property.type);
      if (uses[k] >= 3) {
        if (is_float(property.type)) {
          if (std::isfinite(value)) read.brightest_float = std::max(read.brightest_float, value);
          value *= float_scale;
        } else {
          value *= colour_scale(property.type);
        }
      }
      values[uses[k]] = value;
    }
    if (!std::isfinite(values[3]) || !std::isfinite(values[4]) || !std::isfinite(values[5])) {
      ++without_colour;
      continue;
    }
    if (!read.cloud.add(values[0], values[1], values[2])) {
      ++without_position;
      continue;
    }
    if (!has_colours) continue;
    for (size_t k = 3; k < 6; ++k) {
      read.cloud.rgb.push_back(uint8_t(std::clamp(values[k], 0.0, 255.0) + 0.5));
    }
  }
  report.add(kPointsNotFinite, "", without_position);
  report.add(kColoursNotFinite, "", without_colour);
  return read;
}

}  // namespace

PointCloud read_ply_file(const std::string& path, const std::array<double, 3>& origin, ImportReport& report) {
  ImportReport first_report = report;
  Vertices read = read_vertices(path, origin, 255, first_report);
  // A little over 1 is rounding. The file is read again rather than kept twice.
  if (read.brightest_float > 1.01) {
    read = {};
    read = read_vertices(path, origin, 1, report);
  } else {
    report = first_report;
  }
  return std::move(read.cloud);
}

}  // namespace maq
