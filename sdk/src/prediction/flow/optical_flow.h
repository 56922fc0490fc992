// Dense optical flow between two frames by dense inverse search (DIS, Kroeger et al., ECCV 2016). Inverse compositional
// Lucas-Kanade runs on 8 x 8 patches, coarse to fine; the patches over a pixel then vote on its motion, weighted by
// fit.
#pragma once

#include <vector>

#include "core/worker_threads.h"
#include "prediction/flow/luma_pyramid.h"
#include "prediction/flow/patch_search.h"

namespace maq {

// A displacement per pixel: the point at (x, y) of one image is at (x + dx, y + dy) of the other.
struct FlowField {
  int width_px = 0, height_px = 0;
  std::vector<float> dx_px, dy_px;

  void resize(int width, int height);
};

// How well two images fit: means over all patches of luma variances.
struct FlowFit {
  float contrast = 0;  // of the first image
  float still = 0;     // of the difference without motion
  float moved = 0;     // of the difference along the flow
};

class OpticalFlow {
 public:
  // Finds where each pixel of `from`'s finest level is in `to`, a pyramid of the same sizes. The displacement is
  // exactly 0 where motion explains hardly more than no motion, so that noise does not move. Allocates nothing for a
  // known size and thread count. Not for two threads at once.
  FlowFit find(const LumaPyramid& from, const LumaPyramid& to, WorkerThreads& threads, FlowField& flow);

 private:
  void match(const LumaLevel& from, const LumaLevel& to, const FlowField* coarser, WorkerThreads& threads);
  void hold_still(WorkerThreads& threads);
  void smooth(WorkerThreads& threads, FlowField& flow);
  void densify(const LumaLevel& from, const LumaLevel& to, WorkerThreads& threads, FlowField& flow);

  int columns_ = 0, rows_ = 0;  // of patches
  std::vector<Patch> patches_, next_;
  std::vector<FlowField> fields_;          // by level, without the finest
  FlowField across_;                       // smoothed along rows only
  std::vector<std::vector<float>> votes_;  // [workers]: weights and weighted displacements
};

}  // namespace maq
