#include "sources/android/camera2_mailbox.h"

#include <cstdint>
#include <map>

#include "sources/android/camera2_errors.h"

namespace maq {
namespace {

struct Mailboxes {
  std::mutex mutex;
  std::map<void*, Camera2Mailbox*> open;
  uintptr_t last_number = 0;
};

// Never destroyed: Android's threads may call back while the process ends.
Mailboxes& mailboxes() {
  static auto* const all = new Mailboxes;
  return *all;
}

// Calls `post` with the mailbox of that number, which cannot go away meanwhile.
template <class Post>
void with_mailbox(void* number, Post post) {
  Mailboxes& all = mailboxes();
  std::lock_guard<std::mutex> lock(all.mutex);
  const auto found = all.open.find(number);
  if (found != all.open.end()) post(*found->second);
}

// C code calls these: noexcept.

void on_disconnected(void* number, ndk::ACameraDevice*) noexcept {
  with_mailbox(number, [](Camera2Mailbox& mailbox) { mailbox.post_loss(kCamera2Disconnected); });
}

void on_error(void* number, ndk::ACameraDevice*, int error) noexcept {
  with_mailbox(number, [error](Camera2Mailbox& mailbox) { mailbox.post_loss(camera2_loss(error)); });
}

void on_image(void* number, ndk::AImageReader*) noexcept {
  with_mailbox(number, [](Camera2Mailbox& mailbox) { mailbox.post_image(); });
}

void on_failed(void* number, ndk::ACameraCaptureSession*, ndk::ACaptureRequest*,
               ndk::ACameraCaptureFailure* failure) noexcept {
  if (failure->wasImageCaptured) return;
  with_mailbox(number, [](Camera2Mailbox& mailbox) { mailbox.post_lost_frame(); });
}

void on_buffer_lost(void* number, ndk::ACameraCaptureSession*, ndk::ACaptureRequest*, ndk::ANativeWindow*,
                    int64_t) noexcept {
  with_mailbox(number, [](Camera2Mailbox& mailbox) { mailbox.post_lost_frame(); });
}

void on_session(void*, ndk::ACameraCaptureSession*) noexcept {}

}  // namespace

Camera2Mailbox::Camera2Mailbox() {
  Mailboxes& all = mailboxes();
  std::lock_guard<std::mutex> lock(all.mutex);
  number_ =
      reinterpret_cast<void*>(++all.last_number);  // NOLINT(performance-no-int-to-ptr): handed back, never followed
  all.open[number_] = this;
}

Camera2Mailbox::~Camera2Mailbox() {
  Mailboxes& all = mailboxes();
  std::lock_guard<std::mutex> lock(all.mutex);
  all.open.erase(number_);
}

ndk::ACameraDevice_StateCallbacks Camera2Mailbox::device_callbacks() const {
  return {number_, on_disconnected, on_error};
}

ndk::AImageReader_ImageListener Camera2Mailbox::image_listener() const { return {number_, on_image}; }

ndk::ACameraCaptureSession_captureCallbacks Camera2Mailbox::capture_callbacks() const {
  ndk::ACameraCaptureSession_captureCallbacks callbacks{};
  callbacks.context = number_;
  callbacks.onCaptureFailed = on_failed;
  callbacks.onCaptureBufferLost = on_buffer_lost;
  return callbacks;
}

ndk::ACameraCaptureSession_stateCallbacks Camera2Mailbox::session_callbacks() {
  return {nullptr, on_session, on_session, on_session};
}

void Camera2Mailbox::post_loss(const char* how) noexcept {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (lost_ == nullptr) lost_ = how;  // what follows is a consequence
  }
  posted_.signal();
}

Camera2Mailbox::Item Camera2Mailbox::take(const char*& how) {
  const bool is_posted = posted_.take();
  std::lock_guard<std::mutex> lock(mutex_);
  if (lost_ != nullptr) {
    how = lost_;
    return Item::kLost;
  }
  return is_posted ? Item::kImage : Item::kNone;
}

}  // namespace maq
