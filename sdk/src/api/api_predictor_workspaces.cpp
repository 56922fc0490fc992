#include "api/handle.h"
#include "prediction/predictor_workspace.h"

namespace maq {

std::shared_ptr<PredictorWorkspaces> ContextState::predictor_workspaces() const {
  std::lock_guard<std::mutex> lock(mutex_);
  if (predictor_workspaces_ == nullptr) predictor_workspaces_ = std::make_shared<PredictorWorkspaces>();
  return predictor_workspaces_;
}

}  // namespace maq
