// Codes of a frame -> the picture that they stand for.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "nn/session.h"
#include "prediction/codes/code_bundle.h"

namespace maq {

// For several streams, from any thread: their pictures are made one after another.
class FrameDecoder {
 public:
  // The network is opened when it is needed first. `settings.threads` is a number.
  FrameDecoder(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
               const SessionSettings& settings);

  int frame_px() const { return frame_px_; }

  // `codes`: [places][slices], each below the number of entries. `rgb`: [frame_px][frame_px][3]. Throws what Session
  // throws, MAQ_ERROR_INFERENCE also where the network gives no finite numbers; `rgb` is then as before.
  void run(const uint16_t* codes, uint8_t* rgb);
  // The same in float, not limited to 0..255; or of features as the encoder has them, [places][slices * width].
  void picture(const uint16_t* codes, float* rgb);
  void picture(const float* features, float* rgb);

 private:
  // Of features_. The mutex is held.
  const float* decode();
  void look_up(const uint16_t* codes);
  size_t values() const { return size_t(frame_px_) * size_t(frame_px_) * 3; }

  const std::shared_ptr<const OnnxRuntimeLibrary> runtime_;
  const std::shared_ptr<const FrameCodes> codes_;
  const int frame_px_;
  const Shape input_shape_;
  const std::vector<Shape> output_shapes_;
  const GraphSpec graph_;
  const std::string name_;
  const SessionSettings settings_;

  std::mutex mutex_;            // of what follows
  std::vector<uint8_t> bytes_;  // of the network, until it is opened
  std::unique_ptr<Session> session_;
  std::vector<float> features_;
  std::vector<TensorView> inputs_;
};

}  // namespace maq
