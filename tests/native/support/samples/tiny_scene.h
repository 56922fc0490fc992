// The scene networks, capture and descriptors of data/tiny_scene (make_tiny_scene.py).
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/log.h"
#include "scene/capture/capture.h"
#include "scene/networks/scene_networks.h"
#include "support/temp_folder.h"

namespace tiny_scene {

inline const std::string kFolder = std::string(MAQ_TEST_DATA) + "/tiny_scene";

inline std::shared_ptr<const maq::OnnxRuntimeLibrary> runtime() {
  static const auto opened = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
  return opened;
}

inline std::unique_ptr<maq::SceneNetworks> networks(int threads = 1) {
  return std::make_unique<maq::SceneNetworks>(runtime(), maq::read_bundle(kFolder + "/bundle"),
                                              maq::SessionSettings{threads});
}

inline maq::Capture capture() { return maq::open_capture(kFolder + "/capture"); }

struct Descriptor {
  uint32_t index, views;
  float constant_terms[maq::kFeatures], linear_terms[maq::kLinearTerms], view_dependence;
};

// Descriptors that torch computed.
inline std::vector<Descriptor> expected_descriptors() {
  const std::string bytes = read_text(kFolder + "/looks.bin");
  std::vector<Descriptor> descriptors(bytes.size() / sizeof(Descriptor));
  std::memcpy(descriptors.data(), bytes.data(), descriptors.size() * sizeof(Descriptor));
  return descriptors;
}

inline std::array<float, 3> expected_background() {
  const std::string bytes = read_text(kFolder + "/background.bin");
  std::array<float, 3> colour{};
  std::memcpy(colour.data(), bytes.data(), std::min(bytes.size(), sizeof colour));
  return colour;
}

}  // namespace tiny_scene
