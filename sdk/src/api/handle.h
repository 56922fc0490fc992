// What every handle of the C API begins with, and the context.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "core/bounded_pool.h"
#include "core/log.h"
#include "maquette/context.h"
#include "nn/onnxruntime_library.h"

namespace maq {

// How many calls of fork() lie between this process and the first that loaded the library.
uint32_t fork_count();

// Every handle begins with this, so that maq_last_error works on each of them.
class Handle {
 public:
  // In a child of fork(), the objects of the parent have no threads, their mutexes may be locked for good, and their
  // files and devices are the parent's: nothing may touch them.
  bool is_of_parent() const { return fork_count_ != fork_count(); }

  void set_error(std::string text) const {
    std::lock_guard<std::mutex> lock(mutex_);
    error_ = std::move(text);
  }
  std::string error() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return error_;
  }

 private:
  const uint32_t fork_count_ = fork_count();
  mutable std::mutex mutex_;
  mutable std::string error_;
};

// For the `_destroy` and `_close` functions; NULL is fine.
template <class T>
void destroy(T* handle) {
  if (handle != nullptr && !handle->is_of_parent()) delete handle;
}

// What the objects made from a context keep of it when it is destroyed before them.
class ContextState {
 public:
  ContextState(Log log, std::string onnxruntime_path) : log_(log), onnxruntime_path_(std::move(onnxruntime_path)) {}

  const Log& log() const { return log_; }

  // Opens the library at the first call; tries again after a failure.
  std::shared_ptr<const OnnxRuntimeLibrary> onnxruntime() {
    std::lock_guard<std::mutex> lock(mutex_);
    if (onnxruntime_ == nullptr) onnxruntime_ = std::make_shared<OnnxRuntimeLibrary>(onnxruntime_path_, log_);
    return onnxruntime_;
  }

 private:
  Log log_;
  std::string onnxruntime_path_;
  std::mutex mutex_;
  std::shared_ptr<const OnnxRuntimeLibrary> onnxruntime_;
};

}  // namespace maq

struct maq_context : maq::Handle {
  explicit maq_context(std::shared_ptr<maq::ContextState> made) : state(std::move(made)) {}
  std::shared_ptr<maq::ContextState> state;
};

namespace maq {

// Lends a handle of a pool to the caller.
template <class T>
T* lend(typename BoundedPool<T>::Pooled handle) {
  handle->set_error({});  // of its use before
  handle->deleter = handle.get_deleter();
  return handle.release();
}

// Returns it; NULL is fine.
template <class T>
void return_to_pool(T* handle) {
  if (handle != nullptr && !handle->is_of_parent()) std::exchange(handle->deleter, {})(handle);
}

}  // namespace maq
