// The prior of data/tiny_head, and what numpy reads in it (make_tiny_head.py).
#pragma once

#include <cstring>
#include <string>
#include <vector>

#include "head/field/weight_bases.h"
#include "support/temp_folder.h"

namespace tiny_head {

inline const std::string kFolder = std::string(MAQ_TEST_DATA) + "/tiny_head";
inline const maq::head::FieldCodes kCodes = {{0.5f, -1.25f, 2.0f}, {-0.75f, 1.5f}};

inline std::vector<float> read_floats(const std::string& name) {
  const std::string bytes = read_text(kFolder + "/" + name);
  std::vector<float> values(bytes.size() / sizeof(float));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(float));
  return values;
}

}  // namespace tiny_head
