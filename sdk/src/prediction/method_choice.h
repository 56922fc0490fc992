// Which method was right about the frames that have arrived: what each would have said of them is compared with them,
// at several horizons.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "maquette/prediction.h"
#include "prediction/extrapolation.h"
#include "prediction/grey_pyramid.h"
#include "prediction/optical_flow.h"

namespace maq {

class MethodChoice {
 public:
  MethodChoice();

  // Forgets all frames and what was right about them.
  void reset();

  // A frame has arrived: first the methods are judged by it, then it is remembered. `flow` is its motion over
  // `interval_ns`, of the pyramid's finest level; 0: none is known, as of a stream's first frame. Takes nothing from
  // the heap once kFrames frames of a size have come.
  void add(const GreyPyramid& pyramid, int64_t timestamp_ns, const FlowField& flow, int64_t interval_ns,
           WorkerThreads& threads);

  // MAQ_PREDICTION_MOTION where its errors were smaller at the horizon nearest to that, else MAQ_PREDICTION_LAST.
  maq_prediction_method choose(int64_t ahead_ns) const;

 private:
  static constexpr size_t kHorizons = 5, kFrames = 16;

  struct Past {
    int64_t timestamp_ns = 0, interval_ns = 0;
    int width_px = 0, height_px = 0;
    std::vector<uint8_t> grey;  // and a byte
    FlowField flow;
    bool moves = false;
  };

  // Logarithms of the mean squares of the differences of brightness (which PSNR is of), in a mean in which later ones
  // count more: a moment in which everything was wrong must not outweigh many.
  struct Horizon {
    int64_t ahead_ns = 0;
    double last_error = 0, motion_error = 0;
    int count = 0;
    Extrapolation extrapolation;
    std::vector<uint8_t> predicted;
    WorkerThreads alone{1};
  };

  void judge(Horizon& horizon, const Past& now) const;

  std::array<Horizon, kHorizons> horizons_;
  std::array<Past, kFrames> past_;
  size_t count_ = 0;  // of all frames remembered so far; the newest lies before it in past_, round and round
  Past now_;
};

}  // namespace maq
