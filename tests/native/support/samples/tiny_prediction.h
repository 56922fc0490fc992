// The bundle of data/tiny_prediction, and what torch makes of frames there (make_tiny_prediction.py).
#pragma once

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/log.h"
#include "prediction/codec/frame_decoder.h"
#include "prediction/codec/frame_encoder.h"
#include "support/temp_folder.h"

namespace tiny_prediction {

inline const std::string kFolder = std::string(MAQ_TEST_DATA) + "/tiny_prediction";
inline const std::string kBundle = kFolder + "/bundle";
constexpr int kFrames = 6, kSide_px = 64;  // the last frame is of another scene
constexpr int64_t kFrame_ns = 100000000;

inline std::shared_ptr<const maq::OnnxRuntimeLibrary> runtime() {
  static const auto opened = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
  return opened;
}

inline std::shared_ptr<maq::FrameEncoder> encoder(const std::string& bundle = kBundle) {
  maq::SessionSettings settings;
  return std::make_shared<maq::FrameEncoder>(runtime(), maq::CodeBundle(maq::read_bundle(bundle)), settings);
}

inline maq::Frame frame_of(const uint8_t* rgb, int width, int height, int64_t time_ns) {
  maq::Frame frame;
  std::memcpy(frame.allocate(MAQ_PIXEL_RGB8, width, height), rgb, size_t(width) * size_t(height) * 3);
  frame.timestamp_ns = time_ns;
  return frame;
}

inline maq::Frame frame(int number, int64_t time_ns) {
  static const std::string all = read_text(kFolder + "/frames.rgb");
  const auto* const first = reinterpret_cast<const uint8_t*>(all.data());
  return frame_of(first + size_t(number) * kSide_px * kSide_px * 3, kSide_px, kSide_px, time_ns);
}
inline maq::Frame frame(int number) { return frame(number, number * kFrame_ns); }

}  // namespace tiny_prediction
