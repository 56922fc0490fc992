// Refines a small predicted image by a network that also sees the past frames.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "nn/session.h"
#include "prediction/codec/code_bundle.h"

namespace maq {

// The time inputs of a network with a variable horizon, read from the bundle's manifest.
struct TimeInputs {
  float min_fps = 0, max_fps = 0;  // frame rates in training
  float max_ahead = 0;             // longest horizon in training, in frames

  // Throws MAQ_ERROR_BAD_BUNDLE for a key that is missing or out of range.
  static TimeInputs read(const ManifestNode& node);

  // Writes log2(10 * seconds) of the frame interval and of the horizon, both clamped to the range in training.
  void write(float step_s, float ahead_s, float* two) const;
};

// Shared by streams, from any thread; images are refined one after another.
class ResidualRefiner {
 public:
  static constexpr size_t kMaxBefore = 16;

  static bool is_in(const CodeBundle& bundle) { return bundle.bundle.manifest.root.find("mended").has_value(); }
  // `settings.threads` is a number. The bundle is not needed afterwards. Throws MAQ_ERROR_BAD_BUNDLE when the manifest
  // is incomplete or the graph does not match; the exceptions of Session.
  ResidualRefiner(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                  const SessionSettings& settings);

  size_t before() const { return before_; }  // past frames that the network sees

  // `frames`: before() past frames, the oldest first, `step_s` apart, each [frame_px][frame_px][3], R, G, B. A null one
  // is replaced by the oldest that is known; the last is not null. `predicted`: the image to refine, `ahead_s` after
  // the newest frame. `refined`: [frame_px][frame_px][3], not clamped to 0..255. Throws MAQ_ERROR_INFERENCE, also when
  // the network returns numbers that are not finite; `refined` is then unchanged.
  void run(const uint8_t* const* frames, const uint8_t* predicted, float step_s, float ahead_s, float* refined);

 private:
  size_t before_ = 0, values_ = 0;  // of an image
  TimeInputs trained_;
  std::unique_ptr<Session> session_;

  std::mutex mutex_;  // guards the members below and the session
  std::vector<float> given_, times_;
  std::vector<TensorView> inputs_;
  std::vector<Shape> outputs_;
};

}  // namespace maq
