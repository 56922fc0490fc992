// Predicts the next frames of a stream. Implementations: motion (blend/), sampled (sampling/).
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/frame.h"

namespace maq {

enum class PredictionMethod {
  kAuto,    // the last frame and the motion prediction, blended
  kLast,    // the last frame
  kMotion,  // the motion prediction
  kSampled
};

struct PredictorStats {
  float luma_ms = 0, flow_ms = 0, weights_ms = 0, push_ms = 0;  // the latest push
  float project_ms = 0, warp_ms = 0, predict_ms = 0;            // the latest prediction, without networks
  float networks_ms = 0;                                        // the latest push, prediction or sampling; 0: none ran
  PredictionMethod method = PredictionMethod::kLast;            // which made the latest prediction
  float motion_fraction = 0;                                    // of its pixels, before networks changed it
  uint64_t pushed = 0, predicted = 0, resets = 0;
  size_t sampled_frames = 0;  // by the latest prediction or sampling
  size_t decoding_steps = 0;  // for these frames: one a cell, for all samples at once
};

// Not for two threads at once.
class FramePredictor {
 public:
  // The longest time between two frames whose motion is found, and the longest time ahead.
  static constexpr int64_t kMaxInterval_ns = 1000000000, kMaxAhead_ns = 10000000000;

  FramePredictor() = default;
  FramePredictor(const FramePredictor&) = delete;
  FramePredictor& operator=(const FramePredictor&) = delete;
  virtual ~FramePredictor() = default;

  // Copies the stream's next frame. Forgets the earlier frames when this one has another size, format or clock, is
  // earlier, is more than kMaxInterval_ns later, or shows another scene (a cut). A frame with the time of the newest
  // one replaces it. Throws MAQ_ERROR_UNSUPPORTED for a depth image, and MAQ_ERROR_INFERENCE.
  virtual void push(const Frame& frame) = 0;

  // Predicts the frame `ahead_ns` after the newest one, 0 to kMaxAhead_ns, in its size and format. Reuses the memory of
  // `frame`. Throws MAQ_ERROR_INVALID_ARGUMENT for another time or before the first frame, and MAQ_ERROR_INFERENCE.
  virtual void predict(int64_t ahead_ns, Frame& frame) = 0;

  // Forgets the stream.
  virtual void reset() = 0;

  virtual PredictorStats stats() const = 0;
};

}  // namespace maq
