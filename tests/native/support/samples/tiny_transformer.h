// The bundle of data/tiny_transformer, and what torch says of codes there (make_tiny_transformer.py).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "prediction/transformer/code_transformer.h"
#include "support/samples/tiny_prediction.h"

namespace tiny_transformer {

inline const std::string kFolder = std::string(MAQ_TEST_DATA) + "/tiny_transformer";
inline const std::string kBundle = kFolder + "/bundle";
constexpr size_t kCodes = 512;  // of a frame
constexpr float kStep_s = 0.1f;

inline std::shared_ptr<maq::CodeTransformer> open(const std::string& bundle = kBundle, int threads = 1) {
  maq::SessionSettings settings;
  settings.threads = threads;
  return std::make_shared<maq::CodeTransformer>(tiny_prediction::runtime(), maq::CodeBundle(maq::read_bundle(bundle)),
                                                settings);
}

inline std::vector<float> floats_of(const std::string& file) {
  const std::string stored = read_text(kFolder + "/" + file);
  std::vector<float> values(stored.size() / sizeof(float));
  std::memcpy(values.data(), stored.data(), stored.size());
  return values;
}

// Codes of tiny_prediction::frame(number), by torch.
inline const uint16_t* codes(int number) {
  static const std::vector<uint16_t> all = [] {
    std::vector<uint16_t> values;
    for (const char code : read_text(tiny_prediction::kFolder + "/codes.u8")) values.push_back(uint8_t(code));
    return values;
  }();
  return all.data() + size_t(number) * kCodes;
}

// The codes from which frame `number` of tiny_prediction is predicted.
inline maq::CodesBefore before(int number) {
  maq::CodesBefore before;
  for (int back = 1; back <= 3 && number - back >= 0; ++back) before.frames[size_t(3 - back)] = codes(number - back);
  before.newest = codes(number - 1);
  before.step_s = kStep_s;
  return before;
}

}  // namespace tiny_transformer
