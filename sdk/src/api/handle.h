// The common base of all handles of the C API, and the context.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "api/handle_state.h"
#include "core/bounded_pool.h"
#include "core/log.h"
#include "maquette/context.h"
#include "nn/onnxruntime_library.h"

namespace maq {

// Every handle begins with this, so that maq_last_error works on each of them.
class Handle {
 public:
  explicit Handle(HandleKind kind) : state_(kind) {}

  HandleState& handle_state() const { return state_; }

  void set_error(std::string text) const {
    std::lock_guard<std::mutex> lock(mutex_);
    error_ = std::move(text);
  }
  // For a handle that is a part of another.
  void set_held(bool is_held) const noexcept {
    if (is_held) {
      set_error({});
      state_.lend_part();
    } else {
      state_.take_back_part();
    }
  }
  std::string error() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return error_;
  }

 private:
  mutable HandleState state_;  // first: it is read before the type of the object is known
  mutable std::mutex mutex_;
  mutable std::string error_;
};

template <HandleKind kind>
class HandleOf : public Handle {
 public:
  static constexpr HandleKind kKind = kind;

  HandleOf() : Handle(kind) {}

  static void* operator new(size_t size_bytes) { return ::operator new(size_bytes); }
  static void operator delete(void* memory) noexcept { HandleState::retire(memory, kind); }
};

class MotionWorkspaces;

// The part of a context that its objects keep when the context is destroyed before them.
class ContextState {
 public:
  ContextState(Log log, std::string onnxruntime_path) : log_(log), onnxruntime_path_(std::move(onnxruntime_path)) {}

  const Log& log() const { return log_; }
  // Returns the scratch memory of the context's predictors, made at the first call. In builds with prediction.
  std::shared_ptr<MotionWorkspaces> motion_workspaces() const;

  // Opens the library at the first call; tries again after a failure.
  std::shared_ptr<const OnnxRuntimeLibrary> onnxruntime() {
    std::lock_guard<std::mutex> lock(mutex_);
    if (onnxruntime_ == nullptr) onnxruntime_ = std::make_shared<OnnxRuntimeLibrary>(onnxruntime_path_, log_);
    return onnxruntime_;
  }

 private:
  Log log_;
  std::string onnxruntime_path_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<MotionWorkspaces> motion_workspaces_;
  std::shared_ptr<const OnnxRuntimeLibrary> onnxruntime_;
};

}  // namespace maq

struct maq_context : maq::HandleOf<maq::HandleKind::kContext> {
  explicit maq_context(std::shared_ptr<maq::ContextState> made) : state(std::move(made)) {}
  std::shared_ptr<maq::ContextState> state;
};

namespace maq {

// Lends a handle of a pool to the caller.
template <class T>
T* lend(typename BoundedPool<T>::Pooled handle) {
  handle->set_error({});  // of its use before
  handle->deleter = handle.get_deleter();
  handle->handle_state().lend();
  return handle.release();
}

// Returns it.
template <class T>
void return_to_pool(T* handle) {
  std::exchange(handle->deleter, {})(handle);
}

}  // namespace maq
