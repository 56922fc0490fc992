#include "api/handle.h"
#include "prediction/blend/motion_workspace.h"

namespace maq {

std::shared_ptr<MotionWorkspaces> ContextState::motion_workspaces() const {
  std::lock_guard<std::mutex> lock(mutex_);
  if (motion_workspaces_ == nullptr) motion_workspaces_ = std::make_shared<MotionWorkspaces>();
  return motion_workspaces_;
}

}  // namespace maq
