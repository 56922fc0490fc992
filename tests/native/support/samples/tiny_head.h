// The bundle for heads of data/tiny_head, and what Python makes of it (make_tiny_head.py).
#pragma once

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/log.h"
#include "head/bundle/head_encoder.h"
#include "head/field/weight_bases.h"
#include "support/temp_folder.h"

namespace tiny_head {

inline const std::string kFolder = std::string(MAQ_TEST_DATA) + "/tiny_head";
inline const std::string kBundle = kFolder + "/bundle";
constexpr int kCrop_px = 32, kCellSide = 8;
inline const maq::head::FieldCodes kCodes = {{0.5f, -1.25f, 2.0f}, {-0.75f, 1.5f}};

inline std::vector<float> read_floats(const std::string& name) {
  const std::string bytes = read_text(kFolder + "/" + name);
  std::vector<float> values(bytes.size() / sizeof(float));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(float));
  return values;
}

inline std::shared_ptr<const maq::OnnxRuntimeLibrary> runtime() {
  static const auto opened = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
  return opened;
}

}  // namespace tiny_head
