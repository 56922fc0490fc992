// The scratch memory of motion predictors. No call leaves data in it for the next one, so predictors share it.
#pragma once

#include <memory>
#include <mutex>

#include "prediction/blend/blend_weights.h"
#include "prediction/flow/extrapolation.h"
#include "prediction/flow/luma_pyramid.h"
#include "prediction/flow/optical_flow.h"

namespace maq {

struct MotionWorkspace {
  LumaPyramid now, before;
  OpticalFlow optical_flow;
  FlowField flow;
  Extrapolation extrapolation;
  BlendWorkspace blend;
  std::unique_ptr<MotionWorkspace> next;  // in the list of idle workspaces
};

// Holds as many workspaces as predictors ever ran at the same time. For any thread.
class MotionWorkspaces {
 public:
  struct GiveBack {
    MotionWorkspaces* to;
    void operator()(MotionWorkspace* workspace) const { to->give_back(workspace); }
  };
  using Borrowed = std::unique_ptr<MotionWorkspace, GiveBack>;

  MotionWorkspaces();
  ~MotionWorkspaces();

  // Returns the workspace that was given back last, so that a single stream reuses its own. Makes one if all are in
  // use.
  Borrowed borrow();

 private:
  void give_back(MotionWorkspace* workspace) noexcept;

  std::mutex mutex_;
  std::unique_ptr<MotionWorkspace> idle_;
};

}  // namespace maq
