// Which method was right about the frames that have arrived, and where: what each would have said of them is compared
// with them, place by place and at several horizons.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "prediction/extrapolation.h"
#include "prediction/grey_pyramid.h"
#include "prediction/optical_flow.h"
#include "prediction/packed_flow.h"

namespace maq {

// What is remembered of a frame.
struct PastFrame {
  int64_t timestamp_ns = 0, interval_ns = 0;
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> grey;  // and a byte
  PackedFlow flow;            // at half the size of `grey`
  bool moves = false;
};

// What judging by one horizon takes of memory.
struct MethodJudge {
  FlowField flow;
  Extrapolation extrapolation;
  std::vector<uint8_t> predicted;
  std::vector<float> latest;  // of each cell: mean square of the differences
  WorkerThreads alone{1};
};

// What judging takes of memory, of which nothing is needed afterwards.
struct MethodWorkspace {
  static constexpr size_t kHorizons = 5;

  PastFrame now;
  std::array<MethodJudge, kHorizons> judges;
};

class MethodWeights {
 public:
  MethodWeights();

  // Forgets all frames and what was right about them.
  void reset();

  // A frame has arrived: first the methods are judged by it, then it is remembered. `flow` is its motion over
  // `interval_ns`, of the pyramid's finest level; 0: none is known, as of a stream's first frame. Takes nothing from
  // the heap once a dozen frames of a size have come.
  void add(const GreyPyramid& pyramid, int64_t timestamp_ns, const FlowField& flow, int64_t interval_ns,
           WorkerThreads& threads, MethodWorkspace& work);

  // How much of each place is motion's, the rest being the last frame's, by their errors there at the horizon nearest
  // to that. Of none where nothing is known yet. Stays until the next call.
  const CellWeights& at(int64_t ahead_ns);

 private:
  static constexpr size_t kHorizons = MethodWorkspace::kHorizons, kFrames = 8;

  // Of each cell: logarithms of the mean squares of the differences of brightness, in a mean in which later frames
  // count more: a moment in which everything was wrong must not outweigh many.
  struct Horizon {
    int64_t ahead_ns = 0;
    std::vector<float> last_errors, motion_errors;
    int count = 0;
  };

  size_t redundant_frame(int64_t now_ns) const;
  void judge(Horizon& horizon, const PastFrame& now, MethodJudge& judge) const;
  void take(const Horizon& horizon, const PastFrame& now, const uint8_t* predicted, std::vector<float>& latest,
            std::vector<float>& errors) const;

  std::array<Horizon, kHorizons> horizons_;
  std::array<PastFrame, kFrames> past_;       // the newest first
  size_t count_ = 0;                          // of those that are known
  int columns_ = 0, rows_ = 0, cell_px_ = 0;  // of cells; cell_px_ in pixels of the flow
  CellWeights weights_;
};

}  // namespace maq
