// Predicts frames without networks: repeats the last frame, moves it on along its motion, or blends both.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "prediction/blend/blend_weights.h"
#include "prediction/blend/motion_workspace.h"
#include "prediction/flow/packed_flow.h"
#include "prediction/frame_predictor.h"

namespace maq {

struct MotionSettings {
  PredictionMethod method = PredictionMethod::kAuto;  // kAuto, kLast or kMotion
  int threads = 1;
  std::shared_ptr<MotionWorkspaces> workspaces = nullptr;  // null: its own
};

class MotionPredictor final : public FramePredictor {
 public:
  explicit MotionPredictor(const MotionSettings& settings);

  void push(const Frame& frame) override {
    keep(frame);
    follow();
  }
  // push() in two steps. The first is short and copies the frame; the second finds its motion.
  void keep(const Frame& frame);
  void follow();

  void predict(int64_t ahead_ns, Frame& frame) override;
  void reset() override;
  PredictorStats stats() const override { return stats_; }

  bool has_frame() const { return has_frame_; }
  // Whether anything moved between the two newest frames; false when that is unknown.
  bool moves() const { return moves_; }
  const MotionSettings& settings() const { return settings_; }

 private:
  MotionWorkspaces::Borrowed borrow();
  // Whether the frame is a copy of the newest one, as sources send that lack a frame. More of them stand still.
  bool is_lone_repeat(const Frame& frame) const;
  // Returns whether the frame continues the stream; otherwise the stream was reset.
  bool continues(const Frame& frame);
  void find_motion(MotionWorkspace& work);

  const MotionSettings settings_;
  MotionWorkspaces own_workspaces_;  // when the settings have none
  WorkerThreads threads_;
  Frame newest_;  // the image in its own memory, and one byte more
  bool has_frame_ = false;
  bool is_again_ = false;    // the newest frame replaced one with the same time
  bool is_repeat_ = false;   // the latest push repeated the newest frame, whose motion goes on
  int repeats_ = 0;          // such pushes in a row
  int64_t latest_ns_ = 0;    // time of the latest push; later than the newest frame's after a repeat
  bool has_luma_ = false;    // newest_luma_ belongs to the newest frame
  bool has_before_ = false;  // before_luma_ belongs to the frame before the newest one
  int64_t before_ns_ = 0;    // time of that frame
  int64_t interval_ns_ = 0;  // time that flow_ spans; 0: the motion is unknown
  bool moves_ = false;
  std::vector<float> newest_luma_;    // finest level of the newest frame's pyramid
  int scale_ = 1;                     // frame pixels a side of one of its pixels
  std::vector<uint8_t> before_luma_;  // the same of the frame before, in whole grey levels
  PackedFlow flow_;
  BlendWeights blend_weights_;
  PredictorStats stats_;
};

}  // namespace maq
