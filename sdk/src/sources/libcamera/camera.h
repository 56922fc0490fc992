// A camera of libcamera that streams.
#pragma once

#include <libcamera/camera.h>
#include <libcamera/framebuffer_allocator.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "sources/camera_backend.h"
#include "sources/libcamera/controls.h"
#include "sources/libcamera/manager.h"
#include "sources/libcamera/receiver.h"

namespace maq {

class LibcameraCamera final : public Camera {
 public:
  // `name`: an id of libcamera, or a number in its list.
  explicit LibcameraCamera(std::string name) : name_(std::move(name)) {}
  ~LibcameraCamera() override;

  // Both while lock_libcamera's mutex is held. tear_down() also after a start() that threw.
  void start(const CameraRequest& request, int buffers);
  void tear_down();

  const CameraFormat& format() const override { return format_; }
  const std::string& identity() const override { return identity_; }
  maq_source_control_info control(maq_source_control which) override;
  void set_control(maq_source_control which, double value) override;
  Event wait(int wake_fd, int timeout_ms, CameraBuffer& buffer, std::string& reason) override;
  void give_back(int slot) override;
  int dma_buf(int slot) override { return slots_[size_t(slot)].dma_buf; }
  void close() override;

 private:
  struct Mapping {
    libcamera::SharedFD fd;  // open as long as a frame may be held, also when libcamera has closed its own
    void* data;
    size_t size_bytes;
  };
  // A buffer, its request, and where its pixels are.
  struct Slot {
    std::unique_ptr<libcamera::Request> request;
    libcamera::FrameBuffer* buffer = nullptr;
    std::vector<Mapping> mappings;  // one for each file
    PlaneView planes[2];
    size_t size_bytes = 0;  // maximum for a JPEG image, minimum for pixels
    int dma_buf = -1;
  };

  void make_slot(libcamera::FrameBuffer& buffer);
  const uint8_t* map(Slot& slot, const libcamera::FrameBuffer::Plane& plane);
  static void synchronize(const Slot& slot, uint64_t flags);
  bool is_filled(Slot& slot) const;
  bool is_unplugged() const;
  void require_streaming() const;
  [[noreturn]] void fail(const std::string& what, int error) const;

  std::string name_, identity_;
  const std::string label_ = "libcamera:" + name_;
  CameraFormat format_;
  size_t stride_bytes_ = 0;
  int cancelled_in_a_row_ = 0;
  std::vector<std::string> device_entries_;
  LibcameraMailbox mailbox_;
  std::vector<Slot> slots_;

  std::unique_ptr<LibcameraManagerUse> manager_;
  std::shared_ptr<libcamera::Camera> camera_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  LibcameraReceiver* receiver_ = nullptr;  // deletes itself
  bool started_ = false;
  bool lost_ = false;  // used by the thread that waits and closes
  std::atomic<bool> is_closed_{false};

  std::mutex mutex_;  // guards the members below and queued requests
  bool streaming_ = false;
  LibcameraControls controls_;
};

}  // namespace maq
