// The coming frames of a stream, from those that were seen.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "maquette/prediction.h"
#include "prediction/method_weights.h"
#include "prediction/packed_flow.h"
#include "prediction/predictor_workspace.h"

namespace maq {

struct PredictorSettings {
  maq_prediction_method method = MAQ_PREDICTION_AUTO;
  int threads = 1;
  std::shared_ptr<PredictorWorkspaces> workspaces = nullptr;  // null: its own
};

// As in maq_predictor_stats.
struct PredictorStats {
  float grey_ms = 0, flow_ms = 0, choice_ms = 0, push_ms = 0;
  float project_ms = 0, fetch_ms = 0, predict_ms = 0;
  maq_prediction_method method = MAQ_PREDICTION_LAST;  // of the latest prediction
  float motion_fraction = 0;                           // of it
  uint64_t pushed = 0, predicted = 0, resets = 0;
};

// Not for two threads at once.
class Predictor {
 public:
  // How far apart frames may be for their motion to be known, and how far ahead frames are predicted.
  static constexpr int64_t kMaxInterval_ns = 1000000000, kMaxAhead_ns = 10000000000;

  explicit Predictor(const PredictorSettings& settings);
  Predictor(const Predictor&) = delete;
  Predictor& operator=(const Predictor&) = delete;

  // The frame is copied. What came before is forgotten where it is of another size, format or clock, not later, more
  // than kMaxInterval_ns later, or shows something else (a cut); a frame of the newest's time replaces that. Throws
  // MAQ_ERROR_UNSUPPORTED for a depth image.
  void push(const Frame& frame) {
    keep(frame);
    follow();
  }
  // The same in two steps: the frame is needed for the first alone, which is short; the second finds its motion.
  void keep(const Frame& frame);
  void follow();

  // What the stream will show `ahead_ns` after the newest frame, 0 to kMaxAhead_ns, in its format. Memory of `frame` is
  // reused. Throws MAQ_ERROR_INVALID_ARGUMENT for another time, or before the first frame.
  void predict(int64_t ahead_ns, Frame& frame);

  void reset();

  bool has_frame() const { return has_frame_; }
  // Whether anything moved between the two newest frames; not where that is not known.
  bool moves() const { return moves_; }
  const PredictorStats& stats() const { return stats_; }
  const PredictorSettings& settings() const { return settings_; }

 private:
  PredictorWorkspaces::Borrowed borrow();

  const PredictorSettings settings_;
  PredictorWorkspaces own_workspaces_;  // where the settings have none
  WorkerThreads threads_;
  Frame newest_;  // the image in its own memory, and a byte
  bool has_frame_ = false;
  bool is_again_ = false;    // the newest one replaced one of its time
  bool has_grey_ = false;    // newest_grey_ is the newest frame's
  bool has_before_ = false;  // a frame that the newest one goes on from, whose grey levels are there
  int64_t before_ns_ = 0;    // its time
  int64_t interval_ns_ = 0;  // of flow_; 0: no motion is known
  bool moves_ = false;
  std::vector<float> newest_grey_;  // the finest level of its pyramid
  int scale_ = 1;                   // of that
  // The same of the frame before, in whole grey levels: for a frame that replaces the newest one.
  std::vector<uint8_t> before_grey_;
  PackedFlow flow_;
  MethodWeights method_weights_;
  PredictorStats stats_;
};

}  // namespace maq
