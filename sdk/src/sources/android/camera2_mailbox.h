// Passes events of a camera from Android's threads to the thread of a source.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

#include "core/files/event_fd.h"
#include "sources/android/camera2_functions.h"

namespace maq {

// The callbacks only post here. A callback that called a function of the camera or its images could deadlock: closing
// them holds their lock and waits for the callback. Older versions of Android may call back for a moment after
// ACameraDevice_close, so the callbacks' context is a number, and events for a mailbox that is gone are dropped.
class Camera2Mailbox {
 public:
  enum class Item { kNone, kImage, kLost };

  Camera2Mailbox();
  ~Camera2Mailbox();
  Camera2Mailbox(const Camera2Mailbox&) = delete;
  Camera2Mailbox& operator=(const Camera2Mailbox&) = delete;

  ndk::ACameraDevice_StateCallbacks device_callbacks() const;
  ndk::AImageReader_ImageListener image_listener() const;
  ndk::ACameraCaptureSession_captureCallbacks capture_callbacks() const;
  // Android wants them, although nothing follows from them.
  static ndk::ACameraCaptureSession_stateCallbacks session_callbacks();

  // Readable as long as there is an item.
  int fd() const { return posted_.get(); }
  // An image that is ready, or the loss of the camera, which goes before images; `how` is static.
  Item take(const char*& how);
  // Frames that the device could not deliver, since the last call.
  uint32_t take_lost_frames() { return lost_frames_.exchange(0); }

  void post_image() noexcept { posted_.signal(); }
  void post_lost_frame() noexcept { ++lost_frames_; }
  void post_loss(const char* how) noexcept;

 private:
  void* number_ = nullptr;  // the callbacks' context
  EventFd posted_{EventFd::Kind::kCounting};
  std::atomic<uint32_t> lost_frames_{0};
  std::mutex mutex_;
  const char* lost_ = nullptr;
};

}  // namespace maq
