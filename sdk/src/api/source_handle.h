#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <vector>

#include "api/frame_handle.h"
#include "maquette/source.h"
#include "sources/registry.h"

namespace maq {

// Returns the caller's config, or the defaults for NULL. `name` begins error texts.
maq_source_config read_source_config(const maq_source_config* given, const char* name);

// Throws ArgumentError for a value out of range. `name` is the name of the config.
SourceSettings source_settings(const maq_source_config& config, const char* name, const Log& log);

}  // namespace maq

struct maq_source : maq::HandleOf<maq::HandleKind::kSource> {
  maq_source(std::string opened, std::unique_ptr<maq::Source> made, size_t pool_size)
      : uri(std::move(opened)), source(std::move(made)), frames(pool_size, "frames") {}
  // Calls of other threads for a frame end before, and a state callback: the app may free the callback's data as soon
  // as this returns, even if a concealer keeps the source.
  ~maq_source() {
    stop();
    source->wait_for_report();
    std::unique_lock<std::mutex> lock(mutex);
    idle.wait(lock, [this] { return calls == 0; });
  }

  void stop() {
    is_stopped = true;
    source->stop();
  }

  std::string uri;
  std::shared_ptr<maq::Source> source;  // a concealer's too
  std::shared_ptr<std::atomic<bool>> is_concealed = std::make_shared<std::atomic<bool>>(false);
  maq::BoundedPool<maq_frame> frames;
  std::atomic<bool> is_stopped{false};
  std::mutex mutex;  // guards the rest
  std::condition_variable idle;
  int calls = 0;
};

namespace maq {

// A call that the end of the source waits for: until it leaves, its errors can be kept with the handle. Of nothing but
// a source that the app has.
class SourceCall {
 public:
  explicit SourceCall(maq_source* source)
      : source_(source != nullptr && source->handle_state().is_held_as(maq_source::kKind) ? source : nullptr) {
    add(1);
  }
  ~SourceCall() { add(-1); }
  SourceCall(const SourceCall&) = delete;
  SourceCall& operator=(const SourceCall&) = delete;

 private:
  void add(int calls) {
    if (source_ == nullptr || source_->handle_state().is_of_parent()) return;
    const std::lock_guard<std::mutex> lock(source_->mutex);
    source_->calls += calls;
    if (source_->calls == 0) source_->idle.notify_all();
  }

  maq_source* source_;
};

}  // namespace maq

struct maq_camera_list : maq::HandleOf<maq::HandleKind::kCameraList> {
  std::vector<maq::CameraListing> cameras;
};
