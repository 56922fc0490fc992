// What the decoder is given of the frame that is expected some time ahead, of all codes at once: the mean of the
// entries by their probabilities. A transformer in one graph (docs/formats.md).
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "nn/session.h"
#include "prediction/codes/code_bundle.h"
#include "prediction/networks/forecast_times.h"
#include "prediction/transformer/row_sums.h"

namespace maq {

// For several streams, from any thread: their frames are foreseen one after another.
class ExpectedFrame {
 public:
  static bool is_in(const CodeBundle& bundle) { return bundle.bundle.manifest.root.find("expected").has_value(); }
  // `settings.threads` is a number. The bundle is not needed afterwards. Throws MAQ_ERROR_BAD_BUNDLE where the manifest
  // lacks what is read, or graph and codes do not belong together; what Session throws.
  ExpectedFrame(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                const SessionSettings& settings);

  size_t before() const { return before_; }  // frames of the stream that are seen
  bool has_motion() const { return frames_ > before_; }

  // `frames`: codes of those before, the oldest first, `step_s` apart, and where has_motion() those that motion
  // foresees for the time `ahead_s` after the newest; null where there are none. The nearest times that it was trained
  // on are taken. `features`: [places][slices * width]. Throws MAQ_ERROR_INFERENCE, also where the network gives
  // numbers that are not finite; `features` are then as before.
  void run(const ContextFrames& frames, float step_s, float ahead_s, float* features);

 private:
  const std::shared_ptr<const FrameCodes> codes_;
  size_t before_ = 0, frames_ = 0;
  ForecastTimes trained_;
  std::unique_ptr<Session> session_;

  std::mutex mutex_;          // of what follows, and of the session
  std::vector<float> given_;  // [frames][slices][places]
  std::vector<float> times_;  // [2]
  std::vector<TensorView> inputs_;
  std::vector<Shape> outputs_;
};

}  // namespace maq
