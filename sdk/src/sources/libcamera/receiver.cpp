#include "sources/libcamera/receiver.h"

#include <utility>

namespace maq {

void LibcameraMailbox::post(Item item) {
  std::lock_guard<std::mutex> lock(mutex_);
  items_.push_back(item);
  posted_.signal();
}

std::optional<LibcameraMailbox::Item> LibcameraMailbox::take() {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!posted_.take() || items_.empty()) return {};
  const Item item = items_.front();
  items_.erase(items_.begin());  // a handful at most
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
