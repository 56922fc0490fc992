#include "prediction/predictor_workspace.h"

#include <utility>

namespace maq {

PredictorWorkspaces::PredictorWorkspaces() = default;
PredictorWorkspaces::~PredictorWorkspaces() = default;

PredictorWorkspaces::Borrowed PredictorWorkspaces::borrow() {
  std::lock_guard<std::mutex> lock(mutex_);
  std::unique_ptr<PredictorWorkspace> found = std::move(idle_);
  if (found == nullptr) {
    found = std::make_unique<PredictorWorkspace>();
  } else {
    idle_ = std::move(found->next);
  }
  return {found.release(), {this}};
}

void PredictorWorkspaces::give_back(PredictorWorkspace* workspace) noexcept {
  std::lock_guard<std::mutex> lock(mutex_);
  workspace->next = std::move(idle_);
  idle_.reset(workspace);
}

}  // namespace maq
