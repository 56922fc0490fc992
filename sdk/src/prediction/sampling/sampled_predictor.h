// Predicts frames by sampling: a transformer decodes the codes of possible next frames, one cell after another.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "prediction/blend/motion_predictor.h"
#include "prediction/codec/frame_decoder.h"
#include "prediction/codec/frame_encoder.h"
#include "prediction/flow/image_residual.h"
#include "prediction/frame_predictor.h"
#include "prediction/transformer/code_history.h"
#include "prediction/transformer/code_transformer.h"
#include "prediction/transformer/motion_codes.h"

namespace maq {

// Shared by streams.
struct SamplerNetworks {
  std::shared_ptr<FrameEncoder> encoder;
  std::shared_ptr<FrameDecoder> decoder;
  std::shared_ptr<CodeTransformer> transformer;
};

// predict() decodes one sample. Two small images are decoded: the sample, and the codes of the motion prediction. Their
// difference is added to the full-size motion prediction, so that the decoder's own error mostly cancels. While nothing
// moves and before the second frame, samples are the last frame.
class SampledPredictor final : public FramePredictor {
 public:
  static constexpr int64_t kTrainedStep_ns = 100000000;  // the longest step in training
  static constexpr int64_t kMaxStep_ns = 125000000;      // treated as kTrainedStep_ns: cameras keep no exact time
  static constexpr size_t kMaxFrames = 64;               // per sample

  // `motion.method` is kAuto; `motion.threads` also add the residual.
  SampledPredictor(SamplerNetworks networks, const SamplingSettings& sampling, const MotionSettings& motion);

  void push(const Frame& frame) override;
  void predict(int64_t ahead_ns, Frame& frame) override;
  void reset() override;
  PredictorStats stats() const override;

  // Samples `samples` sequences of `count` frames, `step_ns` apart (at most kMaxStep_ns). Each is autoregressive;
  // motion is always the motion of the pushed frames. The samples are valid until push(), predict(), reset() or the
  // next call. Throws MAQ_ERROR_INVALID_ARGUMENT before the first frame, MAQ_CANCELLED, and the exceptions of the
  // networks.
  void sample(size_t samples, size_t count, int64_t step_ns);
  // Decodes frame `frame_index` (1-based) of sample `sample_index` (0-based) like predict(). Throws
  // MAQ_ERROR_INVALID_ARGUMENT for a frame that was not sampled.
  void decode(size_t sample_index, size_t frame_index, Frame& frame);
  // Writes the mean entropy of a code of that frame per cell, in bits: [cells]. Throws like decode().
  void copy_entropy(size_t sample_index, size_t frame_index, float* bits) const;
  // Cancels the sampling that runs, or else the next one. From any thread.
  void cancel() noexcept { is_cancelled_ = true; }

  size_t cells() const { return networks_.encoder->codes().cells(); }

 private:
  void forget();
  void sample_frame(size_t frame_index, int64_t step_ns);
  // Returns the offset of a frame in codes_ahead_ and entropy_.
  size_t offset_of(size_t sample_index, size_t frame_index) const;
  void add_residual(const uint16_t* codes, Frame& frame);

  const SamplerNetworks networks_;
  const SamplingSettings sampling_;
  MotionPredictor base_;
  WorkerThreads threads_;
  CodeHistory history_;
  MotionCodes motion_;
  ImageResidual residual_;
  std::vector<uint16_t> codes_, base_codes_;  // [cells][groups]: the newest frame, a motion prediction
  std::vector<CodeHistory> histories_;        // [samples]: with the sample's own frames
  std::vector<CodesBefore> before_;           // [samples]
  std::vector<uint16_t> codes_ahead_;         // [count][samples][cells][groups]
  std::vector<float> entropy_;                // the same shape
  size_t samples_ = 0, count_ = 0;            // of codes_ahead_; count_ 0: none
  int64_t sample_step_ns_ = 0;
  std::vector<uint8_t> input_rgb_;         // [frame_px][frame_px][3]
  std::vector<float> image_, base_image_;  // [frame_px][frame_px][3]
  bool has_frame_ = false;
  int64_t newest_ns_ = 0, step_ns_ = 0;  // step_ns_: from the frame before; 0: unknown
  uint64_t resets_ = 0;                  // of base_
  float networks_ms_ = 0;
  bool is_sampled_ = false;  // the latest prediction
  size_t sampled_frames_ = 0;
  std::atomic<bool> is_cancelled_{false};
};

}  // namespace maq
