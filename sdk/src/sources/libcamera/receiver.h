// Passes events of a camera from libcamera's thread to the thread of a source.
#pragma once

#include <libcamera/base/object.h>
#include <libcamera/camera.h>

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "core/files/event_fd.h"

namespace maq {

class LibcameraMailbox {
 public:
  struct Item {
    int slot = -1;          // slot of a request that came back; -1: the camera is lost
    const char* lost = "";  // how
  };

  // Readable as long as there is an item.
  int fd() const { return posted_.get(); }
  void post(Item item);
  std::optional<Item> take();

 private:
  EventFd posted_{EventFd::Kind::kCounting};
  std::mutex mutex_;
  std::vector<Item> items_;
};

// Receives libcamera's signals of a camera. It lives in libcamera's thread, the only one in which signals can be
// connected and disconnected while they may be sent.
class LibcameraReceiver : public libcamera::Object {
 public:
  LibcameraReceiver(std::shared_ptr<libcamera::Camera> camera, LibcameraMailbox& mailbox);

  // After this nothing more is put into the mailbox, and libcamera's thread has done all that it was asked for before.
  // The receiver deletes itself.
  void retire();

 private:
  void attach();
  void detach();
  void completed(libcamera::Request* request) { mailbox_.post({int(request->cookie()), ""}); }
  void disconnected() { mailbox_.post({-1, "libcamera says that the camera was unplugged"}); }

  std::shared_ptr<libcamera::Camera> camera_;
  LibcameraMailbox& mailbox_;
};

}  // namespace maq
