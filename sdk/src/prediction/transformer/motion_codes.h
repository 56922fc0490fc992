// Codes of the frame that motion alone predicts: an input of the transformer beside the past frames.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/frame.h"
#include "prediction/blend/motion_predictor.h"
#include "prediction/codec/frame_encoder.h"

namespace maq {

// For one stream, in frames of the networks' input size.
class MotionCodes {
 public:
  explicit MotionCodes(std::shared_ptr<FrameEncoder> encoder);

  // Adds the stream's next frame: [frame_px][frame_px][3], R, G, B.
  void add(const uint8_t* rgb, int64_t time_ns);
  void reset();

  // Returns the codes predicted for `target_ns`, [cells][groups], valid until the next call; null before the second
  // frame. `target_ns`: 0 to FramePredictor::kMaxAhead_ns after the newest frame. Returns `newest`, the newest frame's
  // codes, while nothing moves. Throws the exceptions of FrameEncoder::encode().
  const uint16_t* at(int64_t target_ns, const uint16_t* newest);

 private:
  std::shared_ptr<FrameEncoder> encoder_;
  MotionPredictor predictor_;
  Frame seen_, moved_;
  std::vector<uint16_t> codes_;
  int64_t newest_ns_ = 0;
  size_t frames_ = 0;
};

}  // namespace maq
