// The memory in which predictors work, of which nothing is kept from one of their calls to the next: those that take
// turns share it.
#pragma once

#include <memory>
#include <mutex>

#include "prediction/extrapolation.h"
#include "prediction/grey_pyramid.h"
#include "prediction/method_weights.h"
#include "prediction/optical_flow.h"

namespace maq {

struct PredictorWorkspace {
  GreyPyramid now, before;
  OpticalFlow optical_flow;
  FlowField flow;
  Extrapolation extrapolation;
  MethodWorkspace methods;
  std::unique_ptr<PredictorWorkspace> next;  // while nothing works in it
};

// As many as predictors ever worked at once. For any thread.
class PredictorWorkspaces {
 public:
  struct GiveBack {
    PredictorWorkspaces* to;
    void operator()(PredictorWorkspace* workspace) const { to->give_back(workspace); }
  };
  using Borrowed = std::unique_ptr<PredictorWorkspace, GiveBack>;

  PredictorWorkspaces();
  ~PredictorWorkspaces();

  // The one that was given back last, so that a stream alone has its own; a new one where all are in use.
  Borrowed borrow();

 private:
  void give_back(PredictorWorkspace* workspace) noexcept;

  std::mutex mutex_;
  std::unique_ptr<PredictorWorkspace> idle_;
};

}  // namespace maq
