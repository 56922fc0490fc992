// A live source whose short gaps are bridged: a frame that is not there when it is due is replaced by one that was
// predicted before.
#pragma once

#include <cstdint>
#include <memory>

#include "core/frame.h"
#include "prediction/blend/motion_predictor.h"
#include "sources/source.h"

namespace maq {

struct ConcealerSettings {
  MotionSettings motion;
  int max_gap_ms = 300;
};

// As in maq_concealer_stats.
struct ConcealerStats {
  uint64_t captured = 0, predicted = 0, dropped = 0, late = 0;
  float latest_gap_ms = 0, latest_wait_ms = 0, max_wait_ms = 0;
};

class Concealer {
 public:
  // Takes frames of `source`, which nothing else may do until the concealer is gone. Throws MAQ_ERROR_UNSUPPORTED for a
  // source that is not live, and MAQ_ERROR_OUT_OF_MEMORY where the system starts no thread.
  Concealer(std::shared_ptr<Source> source, const ConcealerSettings& settings);
  // Within some 20 ms.
  ~Concealer();
  Concealer(const Concealer&) = delete;
  Concealer& operator=(const Concealer&) = delete;

  // The next frame, captured or predicted: Frame::origin says which. As Source::next; throws its errors.
  NextFrame next(int64_t timeout_ns, Frame& frame);

  ConcealerStats stats() const;  // from any thread

 private:
  struct State;

  std::unique_ptr<State> state_;
};

}  // namespace maq
