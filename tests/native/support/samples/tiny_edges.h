// The edge network of data/tiny_edges, and what torch makes of depth frames there (make_tiny_edges.py).
#pragma once

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/log.h"
#include "edges/edges.h"
#include "support/temp_folder.h"

namespace tiny_edges {

inline const std::string kFolder = std::string(MAQ_TEST_DATA) + "/tiny_edges";
inline const std::string kBundle = kFolder + "/bundle";
constexpr float kEps_r = 16;
constexpr int kMultiple_px = 4;

inline std::shared_ptr<const maq::OnnxRuntimeLibrary> runtime() {
  static const auto opened = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
  return opened;
}

inline std::unique_ptr<maq::Edges> edges(int threads = 1, int average_frames = 1) {
  maq::EdgesSettings settings;
  settings.threads = threads;
  settings.average_frames = average_frames;
  return std::make_unique<maq::Edges>(runtime(), maq::read_bundle(kBundle), settings);
}

// Input and output of torch for a frame of one of two sizes.
struct Case {
  int width, height;
  std::string name() const { return std::to_string(width) + "x" + std::to_string(height); }
  std::vector<float> read(const std::string& what) const {
    const std::string bytes = read_text(kFolder + "/" + name() + "_" + what + ".f32");
    std::vector<float> values(bytes.size() / sizeof(float));
    std::memcpy(values.data(), bytes.data(), values.size() * sizeof(float));
    return values;
  }
  maq::Intrinsics intrinsics() const { return {width, height, 31, 47, (width - 1) / 2.0, (height - 1) / 2.0}; }
};
constexpr Case kCases[] = {{24, 20}, {17, 31}};

inline maq::ImageView view_of(const std::vector<float>& metres, int width, int height) {
  return maq::packed_view(MAQ_PIXEL_DEPTH32F, width, height, reinterpret_cast<const uint8_t*>(metres.data()));
}

}  // namespace tiny_edges
