// The coming frames of a stream by networks, on top of what the last frame and motion foresee.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "prediction/codes/frame_decoder.h"
#include "prediction/codes/frame_encoder.h"
#include "prediction/networks/expected_frame.h"
#include "prediction/networks/mended_picture.h"
#include "prediction/networks/picture_difference.h"
#include "prediction/predictor.h"
#include "prediction/transformer/code_history.h"
#include "prediction/transformer/code_transformer.h"
#include "prediction/transformer/motion_codes.h"

namespace maq {

// Shared by streams. The last three may be null where no predictor has that mode.
struct PredictionNetworks {
  std::shared_ptr<FrameEncoder> encoder;
  std::shared_ptr<FrameDecoder> decoder;
  std::shared_ptr<MendedPicture> mended;
  std::shared_ptr<ExpectedFrame> expected;
  std::shared_ptr<CodeTransformer> transformer;
};

enum class NetworkMode {
  kMended,    // what motion foresees, mended
  kExpected,  // the mean of the codes that may come
  kDrawn      // codes of one of what may come, frame after frame
};

struct NetworkSettings {
  NetworkMode mode = NetworkMode::kMended;
  SamplingSettings sampling;
};

// Not for two threads at once.
class NetworkPredictor {
 public:
  // `threads`: for pixels.
  NetworkPredictor(PredictionNetworks networks, const NetworkSettings& settings, int threads);

  // As Predictor::push(). Throws what that and FrameEncoder::run() throw.
  void push(const Frame& frame);
  // As Predictor::predict(). The picture that the last frame and motion foresee is changed by what the networks'
  // picture differs from what they make of that one: their own error then mostly cancels, and what they cannot see
  // stays; of what the mended picture differs from it only half is taken. Nothing is changed while nothing moves, and
  // before the second frame. Throws what that and the networks throw.
  void predict(int64_t ahead_ns, Frame& frame);
  void reset();

  const PredictorStats& stats() const { return base_.stats(); }
  float networks_ms() const { return networks_ms_; }  // of the latest push or prediction
  size_t steps() const { return steps_; }             // frames that were drawn for the latest prediction

 private:
  // Of the time `ahead_ns` after the newest frame: a picture into made_; features of the decoder; codes into drawn_.
  void mend(int64_t ahead_ns);
  void foresee(int64_t ahead_ns);
  void draw(int64_t ahead_ns);

  const PredictionNetworks networks_;
  const NetworkSettings settings_;
  Predictor base_;
  WorkerThreads threads_;
  CodeHistory history_, drawn_history_;  // of modes with codes
  PictureHistory pictures_;              // of the other
  MotionCodes motion_;
  PictureDifference difference_;
  std::vector<uint16_t> codes_, base_codes_, drawn_;
  std::vector<uint8_t> squeezed_;
  std::vector<float> features_, made_, of_base_;
  bool has_frame_ = false;
  int64_t newest_ns_ = 0, step_ns_ = 0;  // the latter from the frame before
  uint64_t resets_ = 0;                  // of base_
  uint32_t frame_ = 0;                   // counts predictions, for random numbers
  float networks_ms_ = 0;
  size_t steps_ = 0;
};

}  // namespace maq
