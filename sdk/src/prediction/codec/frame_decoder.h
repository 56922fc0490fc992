// Decodes the codes of a frame to a small RGB image.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "nn/session.h"
#include "prediction/codec/code_bundle.h"

namespace maq {

// Shared by streams, from any thread; images are decoded one after another.
class FrameDecoder {
 public:
  // Opens the network at the first use. `settings.threads` is a number.
  FrameDecoder(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
               const SessionSettings& settings);

  int frame_px() const { return frame_px_; }

  // `codes`: [cells][groups], each below the number of entries. `rgb`: [frame_px][frame_px][3]; as float it is not
  // clamped to 0..255. Throws MAQ_ERROR_INFERENCE, also when the network returns numbers that are not finite, and the
  // exceptions of Session; `rgb` is then unchanged.
  void decode(const uint16_t* codes, uint8_t* rgb);
  void decode(const uint16_t* codes, float* rgb);

 private:
  // Returns the image of `codes`. The mutex is held.
  const float* run(const uint16_t* codes);
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

  std::mutex mutex_;            // guards the members below
  std::vector<uint8_t> bytes_;  // the network, until it is opened
  std::unique_ptr<Session> session_;
  std::vector<float> features_;
  std::vector<TensorView> inputs_;
};

}  // namespace maq
