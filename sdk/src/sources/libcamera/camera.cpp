#include "sources/libcamera/camera.h"

#include <libcamera/control_ids.h>
#include <libcamera/fence.h>
#include <linux/dma-buf.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/clock.h"
#include "core/error.h"
#include "sources/camera_errors.h"
#include "sources/libcamera/formats.h"

namespace maq {
namespace {

constexpr char kLogHint[] = " LIBCAMERA_LOG_LEVELS=*:INFO in the environment shows what libcamera says to it.";
constexpr int kFenceTimeoutMs = 100;
constexpr int64_t kMaxFrameAgeNs = 10000000000;

}  // namespace

LibcameraCamera::~LibcameraCamera() {
  close();
  for (const Slot& slot : slots_) {
    for (const Mapping& mapping : slot.mappings) munmap(mapping.data, mapping.size_bytes);
  }
}

void LibcameraCamera::fail(const std::string& what, int error) const { fail_camera(label_, what, error, kLogHint); }

void LibcameraCamera::start(const CameraRequest& request, int buffers) {
  manager_ = std::make_unique<LibcameraManagerUse>();
  const std::shared_ptr<libcamera::Camera> found = find_libcamera_camera(**manager_, name_);
  if (const int error = found->acquire(); error < 0) fail("cannot be acquired", error);
  camera_ = found;
  identity_ = found->id();

  const auto configuration = libcamera_configuration(*camera_, label_);
  choose_libcamera_format(*configuration, request, buffers, label_);
  if (const int error = camera_->configure(configuration.get()); error < 0) {
    fail("does not take its own format", error);
  }
  const LibcameraFormat agreed = agreed_libcamera_format(configuration->at(0), label_);
  format_ = agreed.format;
  stride_bytes_ = agreed.stride_bytes;

  libcamera::Stream* const stream = configuration->at(0).stream();
  allocator_ = std::make_unique<libcamera::FrameBufferAllocator>(camera_);
  if (const int error = allocator_->allocate(stream); error < 0) fail("gives no buffers", error);
  const auto& made = allocator_->buffers(stream);
  if (made.size() < 2 || made.size() > 256) {
    refuse_camera(label_, concatenate("gives ", made.size(), " buffers, of which at least 2 are needed"));
  }
  slots_.reserve(made.size());
  for (const auto& buffer : made) make_slot(*buffer);

  device_entries_ = device_entries(**manager_, *camera_);
  controls_ = LibcameraControls(camera_->controls(), label_);
  libcamera::ControlList at_start(libcamera::controls::controls);
  format_.fps = set_libcamera_rate(camera_->controls(), request.fps, at_start);
  receiver_ = new LibcameraReceiver(camera_, mailbox_);
  if (const int error = camera_->start(at_start.empty() ? nullptr : &at_start); error < 0)
    fail("does not start", error);
  started_ = true;
  for (size_t index = 0; index < slots_.size(); ++index) {
    Slot& slot = slots_[index];
    slot.request = camera_->createRequest(index);
    int error = slot.request == nullptr ? -ENOMEM : slot.request->addBuffer(stream, slot.buffer);
    if (error == 0) error = camera_->queueRequest(slot.request.get());
    if (error < 0) fail("takes no requests", error);
  }
  streaming_ = true;
}

void LibcameraCamera::make_slot(libcamera::FrameBuffer& buffer) {
  slots_.emplace_back();
  Slot& slot = slots_.back();
  slot.buffer = &buffer;
  const auto& planes = buffer.planes();
  if (planes.empty()) refuse_camera(label_, "has buffers without memory");
  if (format_.jpeg) {
    slot.planes[0].data = map(slot, planes[0]);
    slot.size_bytes = planes[0].length;
    return;
  }
  size_t before = 0;  // bytes of the planes before this one, where they share one of libcamera's
  for (int plane = 0; plane < plane_count(format_.pixels); ++plane) {
    const size_t index = planes.size() == 1 ? 0 : size_t(plane);
    const size_t rows = size_t(plane_rows(format_.pixels, plane, format_.height_px));
    const size_t row = row_bytes(format_.pixels, plane, format_.width_px);
    const size_t needed = bytes_of_rows(stride_bytes_, int(rows), row).value_or(SIZE_MAX);
    const size_t length = index < planes.size() ? planes[index].length : 0;
    if (row > stride_bytes_ || before > length || needed > length - before) {
      refuse_camera(label_, concatenate("has ", length, " bytes in plane ", index, " of its buffers, and ", needed,
                                        " behind ", before, " are needed"));
    }
    slot.planes[plane] = {map(slot, planes[index]) + before, stride_bytes_};
    slot.size_bytes += needed;
    if (planes.size() == 1) before += stride_bytes_ * rows;
  }
  if (slot.mappings.size() == 1 && planes[0].offset == 0) slot.dma_buf = slot.mappings[0].fd.get();
}

// Returns the begin of the plane. Maps its memory unless an earlier plane in the same file has mapped it.
const uint8_t* LibcameraCamera::map(Slot& slot, const libcamera::FrameBuffer::Plane& plane) {
  auto mapping = std::find_if(slot.mappings.begin(), slot.mappings.end(),
                              [&](const Mapping& other) { return other.fd.get() == plane.fd.get(); });
  if (mapping == slot.mappings.end()) {
    const off_t size = lseek(plane.fd.get(), 0, SEEK_END);
    if (size <= 0) fail("does not say how large its buffers are", size < 0 ? errno : EINVAL);
    void* data = mmap(nullptr, size_t(size), PROT_READ, MAP_SHARED, plane.fd.get(), 0);
    if (data == MAP_FAILED) fail("does not map its buffers into memory", errno);
    slot.mappings.push_back({plane.fd, data, size_t(size)});
    mapping = slot.mappings.end() - 1;
  }
  if (plane.offset == libcamera::FrameBuffer::Plane::kInvalidOffset || plane.offset > mapping->size_bytes ||
      plane.length > mapping->size_bytes - plane.offset) {
    refuse_camera(
        label_, concatenate("has ", plane.length, " bytes at ", plane.offset, " of a buffer of ", mapping->size_bytes));
  }
  return static_cast<const uint8_t*>(mapping->data) + plane.offset;
}

void LibcameraCamera::close() {
  if (is_closed_) return;  // releasing the last frame must not block
  const auto lock = lock_libcamera_to_close();
  tear_down();
}

void LibcameraCamera::tear_down() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    streaming_ = false;
  }
  // Stopping brings every request back. With an unplugged device libcamera (0.0.3 to 0.7.2) cannot stop, and aborts the
  // program because requests are missing; so they are destroyed with the camera then.
  if (started_ && !lost_ && !is_unplugged()) camera_->stop();
  started_ = false;
  if (receiver_ != nullptr) receiver_->retire();
  receiver_ = nullptr;
  for (Slot& slot : slots_) slot.request.reset();
  allocator_.reset();
  if (camera_ != nullptr) camera_->release();
  camera_.reset();
  manager_.reset();
  is_closed_ = true;
}

bool LibcameraCamera::is_unplugged() const {
  return std::any_of(device_entries_.begin(), device_entries_.end(),
                     [](const std::string& entry) { return access(entry.c_str(), F_OK) != 0 && errno == ENOENT; });
}

// Tells the kernel that the processor is going to read the buffer, or has done so: its caches may hold older content.
void LibcameraCamera::synchronize(const Slot& slot, uint64_t flags) {
  for (const Mapping& mapping : slot.mappings) {
    dma_buf_sync request{flags | DMA_BUF_SYNC_READ};
    while (ioctl(mapping.fd.get(), DMA_BUF_IOCTL_SYNC, &request) != 0 && (errno == EINTR || errno == EAGAIN)) {
    }
  }
}

// A fence that is left in the buffer is one that libcamera did not wait for to its end.
bool LibcameraCamera::is_filled(Slot& slot) const {
  if (slot.buffer->metadata().status != libcamera::FrameMetadata::FrameSuccess) return false;
  const std::unique_ptr<libcamera::Fence> fence = slot.buffer->releaseFence();
  if (fence == nullptr || !fence->isValid()) return true;
  pollfd signalled{fence->fd().get(), POLLIN, 0};
  return ::poll(&signalled, 1, kFenceTimeoutMs) == 1 && (signalled.revents & POLLIN) != 0;
}

Camera::Event LibcameraCamera::wait(int wake_fd, int timeout_ms, CameraBuffer& buffer, std::string& reason) {
  const auto lost = [&](const char* how) {
    lost_ = true;
    reason = how;
    return Event::kLost;
  };
  pollfd fds[2] = {{mailbox_.fd(), POLLIN, 0}, {wake_fd, POLLIN, 0}};
  const int ready = ::poll(fds, 2, timeout_ms);
  if (ready < 0 && errno != EINTR) return lost(std::strerror(errno));
  if (ready > 0 && (fds[1].revents & POLLIN) != 0) return Event::kWoken;
  const std::optional<LibcameraMailbox::Item> item = mailbox_.take();
  if (!item) return is_unplugged() ? lost("the camera was unplugged") : Event::kTimeout;
  if (item->slot < 0) return lost(item->lost);

  Slot& slot = slots_[size_t(item->slot)];
  if (slot.request->status() == libcamera::Request::RequestCancelled) {
    // One is cancelled when the camera refuses its setting; when all of them are, nothing will come any more.
    if (is_unplugged()) return lost("the camera was unplugged");
    if (++cancelled_in_a_row_ > 2 * int(slots_.size())) return lost("libcamera cancels every request");
    give_back(item->slot);
    return Event::kTimeout;
  }
  cancelled_in_a_row_ = 0;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    controls_.note(slot.request->metadata());
  }
  const bool filled = is_filled(slot);
  synchronize(slot, DMA_BUF_SYNC_START);
  const libcamera::FrameMetadata& metadata = slot.buffer->metadata();
  size_t used_bytes = 0;
  for (const libcamera::FrameMetadata::Plane& plane : metadata.planes()) used_bytes += plane.bytesused;
  if (format_.jpeg) {
    buffer.jpeg = slot.planes[0].data;
    buffer.jpeg_bytes = std::min(used_bytes, slot.size_bytes);
  } else {
    buffer.image = {format_.pixels, format_.width_px, format_.height_px, {slot.planes[0], slot.planes[1]}};
  }
  buffer.slot = item->slot;
  buffer.sequence = metadata.sequence;
  buffer.damaged = !filled || (!format_.jpeg && used_bytes < slot.size_bytes);
  // libcamera does not name the clock of its times; on most cameras it is this one.
  const int64_t now_ns = monotonic_ns();
  const int64_t taken_ns = int64_t(std::min<uint64_t>(metadata.timestamp, INT64_MAX));
  const bool is_monotonic = taken_ns <= now_ns && taken_ns >= now_ns - kMaxFrameAgeNs;
  buffer.timestamp_ns = is_monotonic ? taken_ns : now_ns;
  return Event::kFrame;
}

void LibcameraCamera::give_back(int index) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!streaming_) return;
  Slot& slot = slots_[size_t(index)];
  synchronize(slot, DMA_BUF_SYNC_END);
  slot.request->reuse(libcamera::Request::ReuseBuffers);
  controls_.take_setting(slot.request->controls());
  if (camera_->queueRequest(slot.request.get()) < 0) mailbox_.post({-1, "libcamera takes no more requests"});
}

void LibcameraCamera::require_streaming() const {
  if (!streaming_) throw Error(MAQ_ERROR_DEVICE_LOST, label_, " is not open any more.");
}

maq_source_control_info LibcameraCamera::control(maq_source_control which) {
  std::lock_guard<std::mutex> lock(mutex_);
  require_streaming();
  return controls_.get(which);
}

void LibcameraCamera::set_control(maq_source_control which, double value) {
  std::lock_guard<std::mutex> lock(mutex_);
  require_streaming();
  controls_.set(which, value);
}

}  // namespace maq
