// What is foreseen without networks, mended by one that sees the frames before as well: small pictures, without codes.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "nn/session.h"
#include "prediction/codes/code_bundle.h"
#include "prediction/networks/forecast_times.h"

namespace maq {

// For several streams, from any thread: their pictures are made one after another.
class MendedPicture {
 public:
  static constexpr size_t kMaxBefore = 16;

  static bool is_in(const CodeBundle& bundle) { return bundle.bundle.manifest.root.find("mended").has_value(); }
  // `settings.threads` is a number. The bundle is not needed afterwards. Throws MAQ_ERROR_BAD_BUNDLE where the manifest
  // lacks what is read, or the graph is another one; what Session throws.
  MendedPicture(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                const SessionSettings& settings);

  size_t before() const { return before_; }  // frames of the stream that are seen

  // `frames`: those before, the oldest first, each R, G, B of [frame_px][frame_px], `step_s` apart; null, the oldest of
  // them, where there are none, but the last is not. `foreseen`: the picture to mend, of the time `ahead_s` after the
  // newest. `picture`: [frame_px][frame_px][3], not limited to 0..255. Throws MAQ_ERROR_INFERENCE, also where the
  // network gives numbers that are not finite; `picture` is then as before.
  void run(const uint8_t* const* frames, const uint8_t* foreseen, float step_s, float ahead_s, float* picture);

 private:
  size_t before_ = 0, values_ = 0;  // of a picture
  ForecastTimes trained_;
  std::unique_ptr<Session> session_;

  std::mutex mutex_;  // of what follows, and of the session
  std::vector<float> given_, times_;
  std::vector<TensorView> inputs_;
  std::vector<Shape> outputs_;
};

}  // namespace maq
