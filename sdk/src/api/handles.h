// What the opaque handles of the C API are.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "core/frame.h"
#include "core/log.h"
#include "densepose/densepose.h"
#include "maquette/maquette.h"
#include "nn/onnxruntime_library.h"
#include "sources/source.h"

namespace maq {

// Every handle begins with this, so that maq_last_error works on each of them.
class Handle {
 public:
  void set_error(std::string text) const {
    std::lock_guard<std::mutex> lock(mutex_);
    error_ = std::move(text);
  }
  std::string error() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return error_;
  }

 private:
  mutable std::mutex mutex_;
  mutable std::string error_;
};

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

struct maq_frame : maq::Handle {
  ~maq_frame() {
    if (free_callback != nullptr) free_callback(user_data);
  }
  std::shared_ptr<const maq::Frame> frame;
  maq_frame_free_callback free_callback = nullptr;
  void* user_data = nullptr;
};

struct maq_source : maq::Handle {
  explicit maq_source(std::unique_ptr<maq::Source> made, size_t pool_size) : source(std::move(made), pool_size) {}
  maq::PooledSource source;
};

struct maq_densepose : maq::Handle {
  maq_densepose(std::shared_ptr<maq::ContextState> of, std::unique_ptr<maq::DensePose> made, size_t pool_size)
      : state(std::move(of)), densepose(std::move(made)), results(pool_size, "results") {}
  std::shared_ptr<maq::ContextState> state;
  std::unique_ptr<maq::DensePose> densepose;
  maq::BoundedPool<maq::DensePoseResult> results;
};

struct maq_densepose_result : maq::Handle {
  std::shared_ptr<const maq::DensePoseResult> result;
  std::vector<maq_person> people;
};
