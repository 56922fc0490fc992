#include "prediction/predictor_workspace.h"

#include <utility>

namespace maq {

PredictorWorkspaces::Borrowed PredictorWorkspaces::borrow() {
  std::lock_guard<std::mutex> lock(mutex_);
  std::unique_ptr<PredictorWorkspace> found;
  if (idle_.empty()) {
    idle_.reserve(made_ + 1);
    found = std::make_unique<PredictorWorkspace>();
    ++made_;
  } else {
    found = std::move(idle_.back());
    idle_.pop_back();
  }
  return {found.release(), {this}};
}

void PredictorWorkspaces::give_back(PredictorWorkspace* workspace) noexcept {
  std::lock_guard<std::mutex> lock(mutex_);
  idle_.emplace_back(workspace);
}

}  // namespace maq
