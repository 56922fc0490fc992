// A frame of any size and format -> its codes.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "core/frame.h"
#include "image/network_input.h"
#include "nn/session.h"
#include "prediction/codes/code_bundle.h"
#include "prediction/codes/nearest_entry.h"

namespace maq {

// Of the latest frame of a stream, in wall-clock milliseconds.
struct EncoderTimes {
  float resize_ms = 0, network_ms = 0, nearest_ms = 0;
};

// For several streams, from any thread: their frames are encoded one after another.
class FrameEncoder {
 public:
  // `settings.threads` may be MAQ_THREADS_MEASURED. The bundle is not needed afterwards. Throws what Session throws.
  FrameEncoder(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle, SessionSettings settings);

  const FrameCodes& codes() const { return *codes_; }
  int frame_px() const { return frame_px_; }
  int threads() const { return threads_; }  // in use

  // Squeezes the frame to a square, by area, in bytes as the network was trained on them, and writes codes().count()
  // numbers: [places][slices]; to `squeezed`, unless it is null, that square: R, G, B of [frame_px][frame_px]. Throws
  // MAQ_ERROR_UNSUPPORTED for a depth image, MAQ_ERROR_INFERENCE, also where the network gives no finite numbers;
  // `found` is then as before.
  EncoderTimes run(const ImageView& image, uint16_t* found, uint8_t* squeezed = nullptr);

  // That square alone. Throws MAQ_ERROR_UNSUPPORTED for a depth image.
  void squeeze(const ImageView& image, uint8_t* squeezed);

 private:
  // Into image_. The mutex is held.
  void resize(const ImageView& image);

  const std::shared_ptr<const FrameCodes> codes_;
  const NearestEntry nearest_;
  const int frame_px_;
  const Shape input_shape_;
  const std::vector<Shape> output_shapes_;
  int threads_ = 1;
  std::unique_ptr<Session> session_;

  std::mutex mutex_;  // of what follows, and of the session
  NetworkInput resized_;
  std::vector<float> image_;  // [frame_px][frame_px][3]: R, G, B in 0..255
  std::vector<TensorView> inputs_;
};

}  // namespace maq
