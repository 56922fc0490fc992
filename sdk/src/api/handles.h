// What the opaque handles of the C API are.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "core/bounded_pool.h"
#include "core/frame.h"
#include "core/log.h"
#include "densepose/densepose.h"
#include "maquette/maquette.h"
#include "nn/onnxruntime_library.h"
#include "scene/capture/capture.h"
#include "scene/format/scene.h"
#include "scene/render/scene_renderer.h"
#include "sources/registry.h"

namespace maq {

// Every handle begins with this, so that maq_get_last_error works on each of them.
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

// Frames of sources and results are whole handles from pools, so that lending one allocates nothing.
struct maq_frame : maq::Handle {
  ~maq_frame() {
    if (release_callback != nullptr) release_callback(user_data);
  }
  maq::Frame frame;
  maq_frame_release_callback release_callback = nullptr;
  void* user_data = nullptr;
  maq::BoundedPool<maq_frame>::Deleter deleter;  // empty: the app's own memory
};

struct maq_source : maq::Handle {
  maq_source(std::string opened, std::unique_ptr<maq::Source> made, size_t pool_size)
      : uri(std::move(opened)), source(std::move(made)), frames(pool_size, "frames") {}
  std::string uri;
  std::unique_ptr<maq::Source> source;
  maq::BoundedPool<maq_frame> frames;
};

struct maq_camera_list : maq::Handle {
  std::vector<maq::CameraListing> cameras;
};

struct maq_densepose_result : maq::Handle {
  maq::DensePoseResult result;
  std::vector<maq_person> people;
  maq::BoundedPool<maq_densepose_result>::Deleter deleter;
};

struct maq_densepose : maq::Handle {
  maq_densepose(std::shared_ptr<maq::ContextState> of, std::unique_ptr<maq::DensePose> made, size_t pool_size)
      : state(std::move(of)), densepose(std::move(made)), results(pool_size, "results") {}
  std::shared_ptr<maq::ContextState> state;
  std::unique_ptr<maq::DensePose> densepose;
  maq::BoundedPool<maq_densepose_result> results;
};

struct maq_capture : maq::Handle {
  explicit maq_capture(maq::Capture opened) : capture(std::move(opened)) {}
  maq::Capture capture;
  std::vector<std::string> dropped;  // as sentences
};

struct maq_scene : maq::Handle {
  explicit maq_scene(maq::Scene made) : scene(std::move(made)) {}
  maq::Scene scene;
};

struct maq_scene_image : maq::Handle {
  maq::RenderedImage image;
  maq::BoundedPool<maq_scene_image>::Deleter deleter;
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
inline void return_to_pool(maq_frame* frame) {
  if (frame == nullptr) return;
  frame->frame.clear();
  std::exchange(frame->deleter, {})(frame);
}
inline void return_to_pool(maq_densepose_result* result) {
  if (result != nullptr) std::exchange(result->deleter, {})(result);
}
inline void return_to_pool(maq_scene_image* image) {
  if (image != nullptr) std::exchange(image->deleter, {})(image);
}

}  // namespace maq
