#include "scene/capture/ply_reader.h"

#include <algorithm>
#include <cmath>

#include "scene/capture/ply_header.h"

namespace maq {
namespace {

// The numbers of a PLY file one after the other.
class PlyNumbers {
 public:
  PlyNumbers(FileReader& file, PlyForm form)
      : file_(file),
        is_text_(form == PlyForm::kAscii),
        order_(form == PlyForm::kBigEndian ? ByteOrder::kBig : ByteOrder::kLittle) {}

  double next(PlyType type) {
    if (is_text_) return next_of_text();
    switch (type) {
      case PlyType::kInt8: return file_.number<int8_t>(order_);
      case PlyType::kUint8: return file_.number<uint8_t>(order_);
      case PlyType::kInt16: return file_.number<int16_t>(order_);
      case PlyType::kUint16: return file_.number<uint16_t>(order_);
      case PlyType::kInt32: return file_.number<int32_t>(order_);
      case PlyType::kUint32: return file_.number<uint32_t>(order_);
      case PlyType::kFloat32: return double(file_.number<float>(order_));
      case PlyType::kFloat64: return file_.number<double>(order_);
    }
    return 0;
  }

  void skip(const PlyProperty& property) {
    if (!property.is_list) {
      next(property.type);
      return;
    }
    const double length = next(property.count_type);
    const uint64_t min_bytes = is_text_ ? 2 : size_bytes(property.type);
    // In text the file's last number needs no space behind it.
    if (!(length >= 0) || length != std::floor(length) || length > double(file_.remaining() + 1) / double(min_bytes)) {
      file_.fail(" has a list \"", property.name, "\" of length ", length, ", but only ", file_.remaining(),
                 " bytes behind it: it is truncated or damaged.");
    }
    if (is_text_) {
      for (uint64_t i = 0; i < uint64_t(length); ++i) next(property.type);
    } else {
      file_.skip(uint64_t(length) * min_bytes);
    }
  }

 private:
  double next_of_text() {
    const std::string_view word = file_.next_word();
    if (word.empty()) file_.fail(" ends early: it is truncated or damaged; copy it again.");
    double number = 0;
    if (!parse_number(word, number)) {
      file_.fail(", line ", file_.line(), ": \"", std::string(word), "\" is not a number.");
    }
    return number;
  }

  FileReader& file_;
  bool is_text_;
  ByteOrder order_;
};

void check_count(const PlyElement& element, PlyForm form, const FileReader& file) {
  const uint64_t min_bytes = element.min_bytes(form);
  if (min_bytes == 0) return;
  const uint64_t max_count = (file.remaining() + 1) / min_bytes;
  if (element.count > max_count) {
    file.fail(" claims ", element.count, " of \"", element.name.substr(0, 40), "\", but has bytes for ", max_count,
              " at most: it is truncated or damaged; copy it again.");
  }
}

void skip_element(const PlyElement& element, PlyForm form, PlyNumbers& numbers, FileReader& file) {
  check_count(element, form, file);
  const bool has_list = std::any_of(element.properties.begin(), element.properties.end(),
                                    [](const PlyProperty& property) { return property.is_list; });
  if (form != PlyForm::kAscii && !has_list) {
    file.skip(element.count * element.min_bytes(form));
    return;
  }
  if (element.properties.empty()) return;
  for (uint64_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) numbers.skip(property);
  }
}

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
    skip_element(*element, header.form, numbers, file);
  }
  check_count(*vertex, header.form, file);
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
