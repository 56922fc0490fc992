#include "pipeline/live_model.h"

#include "core/error.h"

namespace maq {

std::shared_ptr<LiveModelUse> LiveModel::use_for(const void* pipeline) {
  std::unique_lock<std::mutex> lock(mutex_);
  while (use_ != nullptr) {
    if (use_->pipeline() != pipeline) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT,
                  "The model is in use by another pipeline; create one model for each pipeline.");
    }
    if (std::shared_ptr<LiveModelUse> same = use_->weak_from_this().lock()) return same;
    changed_.wait(lock);  // the last owner unloads the model on another thread
  }
  auto made = std::make_shared<LiveModelUse>(shared_from_this(), pipeline);
  use_ = made.get();
  return made;
}

LiveModelUse::~LiveModelUse() {
  model_->unload();
  std::lock_guard<std::mutex> lock(model_->mutex_);
  model_->use_ = nullptr;
  model_->changed_.notify_all();
}

}  // namespace maq
