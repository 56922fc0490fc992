// Predicts frames by motion and refines them by a network.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "prediction/blend/motion_predictor.h"
#include "prediction/codec/frame_encoder.h"
#include "prediction/flow/image_residual.h"
#include "prediction/frame_predictor.h"
#include "prediction/refine/residual_refiner.h"
#include "prediction/transformer/code_history.h"

namespace maq {

// Shared by streams.
struct RefinerNetworks {
  std::shared_ptr<FrameEncoder> encoder;  // for its input size and resizing
  std::shared_ptr<ResidualRefiner> refiner;
};

// The motion prediction, resized to the network's input, is refined; the difference, less half a grey level of noise,
// is added to the full-size prediction. Nothing is refined while nothing moves, and before the second frame.
class RefinedPredictor final : public FramePredictor {
 public:
  // `motion.method` is kAuto; `motion.threads` also add the residual.
  RefinedPredictor(RefinerNetworks networks, const MotionSettings& motion);

  void push(const Frame& frame) override;
  void predict(int64_t ahead_ns, Frame& frame) override;
  void reset() override;
  PredictorStats stats() const override;

 private:
  void forget();

  const RefinerNetworks networks_;
  MotionPredictor base_;
  WorkerThreads threads_;
  ImageHistory images_;
  ImageResidual residual_;
  std::vector<uint8_t> input_rgb_;  // [frame_px][frame_px][3]
  std::vector<float> refined_;      // [frame_px][frame_px][3], then the residual
  bool has_frame_ = false;
  int64_t newest_ns_ = 0, step_ns_ = 0;  // step_ns_: from the frame before; 0: unknown
  uint64_t resets_ = 0;                  // of base_
  float networks_ms_ = 0;
  bool is_refined_ = false;  // the latest prediction
};

}  // namespace maq
