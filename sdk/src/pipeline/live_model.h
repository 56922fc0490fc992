// The interface of a model that a pipeline runs on each frame. The API's adapters implement it for each system; the
// pipeline knows no system.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>

#include "core/frame.h"
#include "maquette/source.h"

namespace maq {

// The output of a model for one frame. Each model derives its own.
class LiveOutput {
 public:
  virtual ~LiveOutput() = default;
  // Tells handles inside the output that the app holds them from now on, or no longer.
  virtual void set_held(bool /*is_held*/) noexcept {}
};

// Returns `output` as a T; replaces an output of another model by a new T. Keeps the memory of outputs that fit.
template <class T>
T& reuse_output(std::unique_ptr<LiveOutput>& output) {
  auto* fitting = dynamic_cast<T*>(output.get());
  if (fitting == nullptr) {
    auto made = std::make_unique<T>();
    fitting = made.get();
    output = std::move(made);
  }
  return *fitting;
}

class LiveModelUse;

class LiveModel : public std::enable_shared_from_this<LiveModel> {
 public:
  virtual ~LiveModel() = default;

  // The pipeline's thread calls load() before the first run(). A second load() loads everything again.
  virtual void load() {}
  virtual void unload() noexcept {}
  // `camera`: intrinsics of the source; nullptr if unknown. Reuses the memory of `output`.
  virtual void run(const Frame& frame, const maq_intrinsics* camera, std::unique_ptr<LiveOutput>& output) = 0;
  virtual void reset() {}            // the next frame begins a new stream
  virtual void cancel() noexcept {}  // from any thread: ends the current run

  // Reserves the model for one pipeline until the last copy of the returned pointer is gone. Returns the same use for
  // the same pipeline. Throws MAQ_ERROR_INVALID_ARGUMENT if another pipeline runs the model.
  std::shared_ptr<LiveModelUse> use_for(const void* pipeline);

 private:
  friend LiveModelUse;

  std::mutex mutex_;  // of the rest
  std::condition_variable changed_;
  LiveModelUse* use_ = nullptr;
};

// Unloads the model at its end.
class LiveModelUse : public std::enable_shared_from_this<LiveModelUse> {
 public:
  LiveModelUse(std::shared_ptr<LiveModel> model, const void* pipeline)
      : model_(std::move(model)), pipeline_(pipeline) {}
  ~LiveModelUse();
  LiveModelUse(const LiveModelUse&) = delete;
  LiveModelUse& operator=(const LiveModelUse&) = delete;

  LiveModel* operator->() const { return model_.get(); }
  const void* pipeline() const { return pipeline_; }

 private:
  const std::shared_ptr<LiveModel> model_;
  const void* const pipeline_;
};

}  // namespace maq
