// Encodes a frame of any size and format as codes.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "core/frame.h"
#include "image/network_input.h"
#include "nn/session.h"
#include "prediction/codec/code_bundle.h"
#include "prediction/codec/nearest_entry.h"

namespace maq {

// Wall-clock milliseconds of one frame.
struct EncoderTimes {
  float resize_ms = 0, network_ms = 0, nearest_ms = 0;
};

// Shared by streams, from any thread; frames are encoded one after another.
class FrameEncoder {
 public:
  // `settings.threads` may be MAQ_THREADS_MEASURED. The bundle is not needed afterwards. Throws the exceptions of
  // Session.
  FrameEncoder(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle, SessionSettings settings);

  const FrameCodes& codes() const { return *codes_; }
  int frame_px() const { return frame_px_; }
  int threads() const { return threads_; }  // in use

  // Writes `codes`, [cells][groups], codes().count() numbers. Writes the network's input to `input_rgb` unless it is
  // null. Throws MAQ_ERROR_UNSUPPORTED for a depth image; MAQ_ERROR_INFERENCE, also when the network returns numbers
  // that are not finite; `codes` is then unchanged.
  EncoderTimes encode(const ImageView& image, uint16_t* codes, uint8_t* input_rgb = nullptr);

  // Writes the network's input alone: the image resized by area to [frame_px][frame_px][3], R, G, B. Throws
  // MAQ_ERROR_UNSUPPORTED for a depth image.
  void resize_to_input(const ImageView& image, uint8_t* input_rgb);

 private:
  // Writes image_. The mutex is held.
  void resize(const ImageView& image);

  const std::shared_ptr<const FrameCodes> codes_;
  const NearestEntry nearest_;
  const int frame_px_;
  const Shape input_shape_;
  const std::vector<Shape> output_shapes_;
  int threads_ = 1;
  std::unique_ptr<Session> session_;

  std::mutex mutex_;  // guards the members below and the session
  NetworkInput resized_;
  std::vector<float> image_;  // [frame_px][frame_px][3]: R, G, B in 0..255
  std::vector<TensorView> inputs_;
};

}  // namespace maq
