// Dense motion between two frames by inverse search on patches (DIS, Kroeger et al., ECCV 2016): Lucas-Kanade on
// patches of 8 x 8, coarse to fine, whose gradients are of the one picture alone (inverse compositional); the patches
// over a pixel then vote on its motion, each the more the better it fits there.
#pragma once

#include <vector>

#include "core/worker_threads.h"
#include "prediction/grey_pyramid.h"
#include "prediction/patch_search.h"

namespace maq {

// A displacement a pixel: what is at (x, y) of the one picture is at (x + dx, y + dy) of the other.
struct FlowField {
  int width_px = 0, height_px = 0;
  std::vector<float> dx_px, dy_px;

  void resize(int width, int height);
};

// How well the two pictures fit, as means over the patches of squares of brightness around the patch's mean.
struct FlowFit {
  float contrast = 0;  // of the first picture
  float still = 0;     // between the two where they are
  float moved = 0;     // between the two along the flow
};

class OpticalFlow {
 public:
  // From each pixel of `from`'s finest level to where it is in `to`, a pyramid of the same sizes. Where moving explains
  // the second picture hardly better than standing still, the displacement is 0 exactly, so that noise does not move.
  // Takes nothing from the heap for a size and a number of threads that were there before. Not for two threads at once.
  FlowFit find(const GreyPyramid& from, const GreyPyramid& to, WorkerThreads& threads, FlowField& flow);

 private:
  void match(const GreyLevel& from, const GreyLevel& to, const FlowField* coarser, WorkerThreads& threads);
  void hold_still(WorkerThreads& threads);
  void smooth(WorkerThreads& threads, FlowField& flow);
  void densify(const GreyLevel& from, const GreyLevel& to, WorkerThreads& threads, FlowField& flow);

  int columns_ = 0, rows_ = 0;  // of patches
  std::vector<Patch> patches_, next_;
  std::vector<FlowField> fields_;          // by level, of the coarser ones; more of larger pictures
  FlowField across_;                       // smoothed along its rows alone
  std::vector<std::vector<float>> votes_;  // of a worker each: weights, and weighted displacements
};

}  // namespace maq
