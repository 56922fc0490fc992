#include "prediction/blend/motion_workspace.h"

#include <utility>

namespace maq {

MotionWorkspaces::MotionWorkspaces() = default;
MotionWorkspaces::~MotionWorkspaces() = default;

MotionWorkspaces::Borrowed MotionWorkspaces::borrow() {
  std::lock_guard<std::mutex> lock(mutex_);
  std::unique_ptr<MotionWorkspace> found = std::move(idle_);
  if (found == nullptr) {
    found = std::make_unique<MotionWorkspace>();
  } else {
    idle_ = std::move(found->next);
  }
  return {found.release(), {this}};
}

void MotionWorkspaces::give_back(MotionWorkspace* workspace) noexcept {
  std::lock_guard<std::mutex> lock(mutex_);
  workspace->next = std::move(idle_);
  idle_.reset(workspace);
}

}  // namespace maq
