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

// Shared by streams. Those that no predictor's mode needs may be null: only modes with codes need the decoder.
struct PredictionNetworks {
  std::shared_ptr<FrameEncoder> encoder;
  std::shared_ptr<FrameDecoder> decoder;
  std::shared_ptr<MendedPicture> mended;
  std::shared_ptr<ExpectedFrame> expected;
  std::shared_ptr<CodeTransformer> transformer;
  std::shared_ptr<PredictorWorkspaces> workspaces;  // of their predictors; null: each its own
};

enum class NetworkMode {
  kMended,    // what the last frame and motion foresee, mended
  kExpected,  // the mean of the codes that may come
  kDrawn      // codes of one of what may come, frame after frame
};

struct NetworkSettings {
  NetworkMode mode = NetworkMode::kMended;
  SamplingSettings sampling;
  size_t passes = 0;  // as of CodeTransformer::draw()
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
  // stays. The mended picture is made from that one, squeezed, so that its difference is taken as it is, less half a
  // grey level. Nothing is changed while nothing moves, and before the second frame. Throws what that and the networks
  // throw.
  void predict(int64_t ahead_ns, Frame& frame);
  void reset();

  // Draws `samples` streams of `count` frames that may come, `step_ns` apart, each seen as true when the next one of
  // its stream is drawn, beside what motion foresees from the true ones; all are the last frame while nothing moves,
  // and before the second frame. `step_ns` is at most kMaxStep_ns. They are known until another frame is pushed,
  // predict() or reset(). Throws MAQ_ERROR_UNSUPPORTED in another mode than kDrawn, MAQ_ERROR_INVALID_ARGUMENT before
  // the first frame; what the networks throw.
  static constexpr int64_t kTrainedStep_ns = 100000000;  // the longest that the transformer knows
  static constexpr int64_t kMaxStep_ns = 125000000;      // taken as that: cameras keep no exact time
  static constexpr size_t kMaxDrawn = 64;                // frames of a stream
  void draw(size_t samples, size_t count, int64_t step_ns);
  // The picture of frame `number`, from 1, of a sample, from 0, as predict() makes it. Throws
  // MAQ_ERROR_INVALID_ARGUMENT for one that was not drawn; what that throws.
  void drawn_picture(size_t sample, size_t number, Frame& frame);
  // Bits of a code there, mean of each place: [places]. Throws MAQ_ERROR_INVALID_ARGUMENT for one that was not drawn.
  void drawn_entropy(size_t sample, size_t number, float* bits) const;
  // From now: as long as the latest push.
  int64_t step_ns() const { return step_ns_; }
  size_t places() const { return networks_.encoder->codes().places(); }

  const PredictionNetworks& networks() const { return networks_; }
  const NetworkSettings& settings() const { return settings_; }
  int threads() const { return base_.settings().threads; }
  const PredictorStats& stats() const { return base_.stats(); }
  float networks_ms() const { return networks_ms_; }  // of the latest push, prediction or draw
  size_t steps() const { return steps_; }             // frames that were drawn for the latest prediction or draw
  // How often networks foresaw for it: the mended picture or the expected codes are one pass. None where nothing moved.
  const DrawCounts& counts() const { return counts_; }

 private:
  // Of the time `ahead_ns` after the newest frame: a picture into made_; features of the decoder.
  void mend(int64_t ahead_ns);
  void foresee(int64_t ahead_ns);
  size_t codes_at(size_t sample, size_t number) const;  // where they begin in drawn_ and entropy_
  // made_ less the picture of the codes of base_'s, at full size: `frame` is changed by that.
  void add_made(Frame& frame);

  const PredictionNetworks networks_;
  const NetworkSettings settings_;
  Predictor base_;
  WorkerThreads threads_;
  CodeHistory history_;      // of modes with codes
  PictureHistory pictures_;  // of the other
  MotionCodes motion_;
  PictureDifference difference_;
  std::vector<uint16_t> codes_, base_codes_;
  std::vector<CodeHistory> histories_;  // by sample, each with its own frames
  std::vector<CodesBefore> before_;
  std::vector<uint16_t> drawn_;  // [count][samples][places][slices]
  std::vector<float> entropy_;
  size_t samples_ = 0, count_ = 0;  // of these; 0: none are known
  int64_t drawn_step_ns_ = 0;
  std::vector<uint8_t> squeezed_;
  std::vector<float> features_, made_, of_base_;
  bool has_frame_ = false;
  int64_t newest_ns_ = 0, step_ns_ = 0;  // the latter from the frame before
  uint64_t resets_ = 0;                  // of base_
  float networks_ms_ = 0;
  size_t steps_ = 0;
  DrawCounts counts_;
};

}  // namespace maq
