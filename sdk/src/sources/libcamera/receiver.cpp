#include "sources/libcamera/receiver.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "core/error.h"

namespace maq {

LibcameraMailbox::LibcameraMailbox() : fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC | EFD_SEMAPHORE)) {
  if (fd_ < 0) {
    throw Error(MAQ_ERROR_OUT_OF_MEMORY, "No event can be made to wait for frames: ", std::strerror(errno), ".");
  }
}

LibcameraMailbox::~LibcameraMailbox() { ::close(fd_); }

void LibcameraMailbox::post(Item item) {
  std::lock_guard<std::mutex> lock(mutex_);
  items_.push_back(item);
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(fd_, &one, sizeof one);
}

std::optional<LibcameraMailbox::Item> LibcameraMailbox::take() {
  std::lock_guard<std::mutex> lock(mutex_);
  uint64_t one = 0;
  if (::read(fd_, &one, sizeof one) != sizeof one || items_.empty()) return {};
  const Item item = items_.front();
  items_.erase(items_.begin());  // of a handful
  return item;
}

LibcameraReceiver::LibcameraReceiver(std::shared_ptr<libcamera::Camera> camera, LibcameraMailbox& mailbox)
    : camera_(std::move(camera)), mailbox_(mailbox) {
  moveToThread(camera_->thread());
  invokeMethod(&LibcameraReceiver::attach, libcamera::ConnectionTypeBlocking);
}

void LibcameraReceiver::retire() {
  invokeMethod(&LibcameraReceiver::detach, libcamera::ConnectionTypeBlocking);
  deleteLater();
}

void LibcameraReceiver::attach() {
  camera_->requestCompleted.connect(this, &LibcameraReceiver::completed);
  camera_->disconnected.connect(this, &LibcameraReceiver::disconnected);
}

void LibcameraReceiver::detach() {
  camera_->requestCompleted.disconnect(this);
  camera_->disconnected.disconnect(this);
  camera_.reset();
}

}  // namespace maq
