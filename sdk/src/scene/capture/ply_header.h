// The head of a PLY file: its elements and their properties.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/files/file_reader.h"

namespace maq {

enum class PlyForm { kAscii, kLittleEndian, kBigEndian };
enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

// The beginning of a text from a file, for sentences: damaged files have letters in it that no terminal shows.
std::string printable(std::string_view text);

size_t size_bytes(PlyType type);
bool is_float(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;  // of each entry for lists
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;  // of a list's length
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;
  uint64_t header_line = 0;

  // Minimum bytes of one element in the file: lists may be empty; in text, a digit and a space for each property.
  uint64_t min_bytes(PlyForm form) const;
  // Index of the property of that name that is not a list; -1 if there is none.
  int index_of(const std::string& property) const;
};

struct PlyHeader {
  PlyForm form = PlyForm::kAscii;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;  // without the keyword
};

// Reads up to the first byte of the data. Throws MAQ_ERROR_UNREADABLE, and MAQ_ERROR_UNSUPPORTED for versions other
// than 1.0.
PlyHeader read_ply_header(FileReader& file);

}  // namespace maq
