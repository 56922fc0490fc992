// Weights for blending the last frame and the motion prediction, per cell. They follow from the errors that both made
// on past frames at the same horizon.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "prediction/flow/extrapolation.h"
#include "prediction/flow/luma_pyramid.h"
#include "prediction/flow/optical_flow.h"
#include "prediction/flow/packed_flow.h"

namespace maq {

// A past frame at reduced size.
struct PastFrame {
  int64_t timestamp_ns = 0, interval_ns = 0;
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> luma;  // and one byte more
  PackedFlow flow;            // at half the size of `luma`
  bool moves = false;
};

// Scratch memory for one horizon.
struct HorizonWorkspace {
  FlowField flow;
  Extrapolation extrapolation;
  std::vector<uint8_t> predicted;
  std::vector<float> latest;  // [cells]: mean squared differences
  WorkerThreads alone{1};
};

// Scratch memory of add(); nothing in it is needed afterwards.
struct BlendWorkspace {
  static constexpr size_t kHorizons = 5;

  PastFrame now;
  std::array<HorizonWorkspace, kHorizons> horizons;
};

class BlendWeights {
 public:
  BlendWeights();

  // Forgets all frames and errors.
  void reset();

  // Measures both methods on a new frame, then keeps the frame. `flow` is its motion over `interval_ns` at the
  // pyramid's finest level; 0: the motion is unknown. Allocates nothing after a dozen frames of one size.
  void add(const LumaPyramid& pyramid, int64_t timestamp_ns, const FlowField& flow, int64_t interval_ns,
           WorkerThreads& threads, BlendWorkspace& work);

  // Returns the share of the motion prediction in each cell, by the errors at the nearest horizon; the last frame has
  // the rest. All 0 while no errors are known. Valid until the next call.
  const CellWeights& at(int64_t ahead_ns);

 private:
  static constexpr size_t kHorizons = BlendWorkspace::kHorizons, kFrames = 8;

  // [cells]: running means of the logarithm of the mean squared luma difference. The logarithm keeps one bad moment
  // from outweighing many good ones.
  struct Horizon {
    int64_t ahead_ns = 0;
    std::vector<float> last_errors, motion_errors;
    int count = 0;
  };

  size_t redundant_frame(int64_t now_ns) const;
  void measure(Horizon& horizon, const PastFrame& now, HorizonWorkspace& work) const;
  void add_errors(const Horizon& horizon, const PastFrame& now, const uint8_t* predicted, std::vector<float>& latest,
                  std::vector<float>& errors) const;

  std::array<Horizon, kHorizons> horizons_;
  std::array<PastFrame, kFrames> past_;       // the newest first
  size_t count_ = 0;                          // of past_
  int columns_ = 0, rows_ = 0, cell_px_ = 0;  // of cells; cell_px_ counts flow pixels
  CellWeights weights_;
};

}  // namespace maq
