#include "scene/capture/ply_header.h"

#include <algorithm>
#include <cmath>
#include <locale>
#include <optional>
#include <sstream>

namespace maq {
namespace {

constexpr size_t kMaxHeaderLineBytes = 4096;
constexpr int kMaxLines = 10000;
constexpr size_t kMaxElements = 64, kMaxProperties = 512;

struct TypeName {
  const char* name;
  const char* sized_name;
  size_t bytes;
};
// In the order of PlyType.
constexpr TypeName kTypes[] = {{"char", "int8", 1},     {"uchar", "uint8", 1},   {"short", "int16", 2},
                               {"ushort", "uint16", 2}, {"int", "int32", 4},     {"uint", "uint32", 4},
                               {"float", "float32", 4}, {"double", "float64", 8}};

PlyType type_of(const std::string& name, const FileReader& file) {
  for (size_t i = 0; i < std::size(kTypes); ++i) {
    if (name == kTypes[i].name || name == kTypes[i].sized_name) return PlyType(i);
  }
  file.fail(", line ", file.line(), ": \"", printable(name), "\" is not a type of PLY files.");
}

PlyForm form_of(const std::string& name, const std::string& version, const FileReader& file) {
  if (version.empty()) file.fail(", line ", file.line(), ": a format needs a name and a version.");
  if (version != "1.0") {
    throw Error(MAQ_ERROR_UNSUPPORTED, file.path(), " is a PLY file of version ", printable(version),
                ", but 1.0 is the one that is read.");
  }
  if (name == "ascii") return PlyForm::kAscii;
  if (name == "binary_little_endian") return PlyForm::kLittleEndian;
  if (name == "binary_big_endian") return PlyForm::kBigEndian;
  file.fail(", line ", file.line(), ": \"", printable(name), "\" is not a format of PLY files.");
}

PlyElement element_of(std::istream& words, const FileReader& file) {
  PlyElement element;
  std::string count_text;
  double count = -1;
  words >> element.name >> count_text;
  // Whole numbers up to there are exact as double.
  if (!parse_number(count_text, count) || !(count >= 0 && count <= 9e15) || count != std::floor(count)) {
    file.fail(", line ", file.line(), ": an element needs a name and how many there are, 0 or more.");
  }
  element.count = uint64_t(count);
  element.header_line = file.line();
  return element;
}

PlyProperty property_of(std::istream& words, const FileReader& file) {
  PlyProperty property;
  std::string type;
  words >> type;
  if (type == "list") {
    property.is_list = true;
    words >> type;
    property.count_type = type_of(type, file);
    if (is_float(property.count_type)) {
      file.fail(", line ", file.line(), ": a list's length is of type ", type, ", but must be of a whole one.");
    }
    words >> type;
  }
  property.type = type_of(type, file);
  words >> property.name;
  if (property.name.empty()) file.fail(", line ", file.line(), ": a property has no name.");
  return property;
}

}  // namespace

std::string printable(std::string_view text) {
  std::string shown(text.substr(0, 40));
  std::replace_if(
      shown.begin(), shown.end(), [](char letter) { return letter < ' ' || letter > '~'; }, '?');
  return shown;
}

size_t size_bytes(PlyType type) { return kTypes[size_t(type)].bytes; }

bool is_float(PlyType type) { return type == PlyType::kFloat32 || type == PlyType::kFloat64; }

uint64_t PlyElement::min_bytes(PlyForm form) const {
  if (form == PlyForm::kAscii) return 2 * properties.size();
  uint64_t bytes = 0;
  for (const PlyProperty& property : properties) {
    bytes += size_bytes(property.is_list ? property.count_type : property.type);
  }
  return bytes;
}

int PlyElement::index_of(const std::string& property) const {
  for (size_t i = 0; i < properties.size(); ++i) {
    if (properties[i].name == property && !properties[i].is_list) return int(i);
  }
  return -1;
}

PlyHeader read_ply_header(FileReader& file) {
  std::string line;
  if (!file.next_line(line, kMaxHeaderLineBytes) || line != "ply") {
    file.fail(" is not a PLY file: its first line is not \"ply\".");
  }
  PlyHeader header;
  std::optional<PlyForm> form;
  for (int i = 0; i < kMaxLines; ++i) {
    if (!file.next_line(line, kMaxHeaderLineBytes)) break;
    std::istringstream words(line);
    words.exceptions(std::ios::badbit);  // without memory
    words.imbue(std::locale::classic());
    std::string keyword;
    words >> keyword;
    if (keyword == "end_header") {
      if (!form) file.fail(" does not say its format; a line \"format ascii 1.0\" or the like is missing.");
      header.form = *form;
      return header;
    }
    if (keyword == "format") {
      std::string name, version;
      words >> name >> version;
      form = form_of(name, version, file);
    } else if (keyword == "element") {
      if (header.elements.size() == kMaxElements) file.fail(" has over ", kMaxElements, " kinds of elements.");
      header.elements.push_back(element_of(words, file));
    } else if (keyword == "property") {
      if (header.elements.empty()) file.fail(", line ", file.line(), ": a property comes before the first element.");
      auto& properties = header.elements.back().properties;
      if (properties.size() == kMaxProperties) file.fail(" has over ", kMaxProperties, " properties in an element.");
      properties.push_back(property_of(words, file));
    } else if (keyword == "comment") {
      header.comments.push_back(line.size() > 8 ? line.substr(8) : "");
    } else if (!keyword.empty() && keyword != "obj_info") {
      file.fail(", line ", file.line(), ": \"", printable(keyword), "\" is nothing that the head of a PLY file has.");
    }
  }
  file.fail(" has no end of its head (\"end_header\"): it is truncated or damaged; copy it again.");
}

}  // namespace maq
