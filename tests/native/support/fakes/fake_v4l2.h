// A camera driver in memory, for the calls of maq::SystemCalls: what Linux would do, and every way it may fail.
#pragma once

#include <linux/videodev2.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <ctime>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sources/v4l2/system_calls.h"
#include "support/fakes/fake_v4l2_controls.h"

class FakeV4l2 : public maq::SystemCalls {
 public:
  struct Mode {
    uint32_t fourcc;
    int width, height;
    int fps;
  };
  // Modes of the device; TRY_FMT takes the nearest size of a format.
  std::vector<Mode> modes = {{V4L2_PIX_FMT_YUYV, 640, 480, 30}, {V4L2_PIX_FMT_YUYV, 320, 240, 30}};
  bool planar = false;
  uint32_t capabilities = V4L2_CAP_STREAMING | V4L2_CAP_VIDEO_CAPTURE;
  uint32_t timestamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  static constexpr unsigned long kOpen = 0, kMmap = 1, kPoll = 2;
  // Answers of the driver, changed by tests of a broken driver.
  size_t stride_bytes = 0;       // 0: rows without padding
  uint32_t granted_buffers = 0;  // 0: as many as were asked for
  uint32_t buffer_bytes = 0;     // 0: as many as a frame has
  uint32_t data_offset[2] = {};  // where images begin in each plane of memory
  uint8_t wrong_planes = 0;      // of memory, added to what TRY_FMT and S_FMT say
  bool endless = false;          // lists that never end
  bool can_export = true;
  FakeV4l2Controls controls;

  ~FakeV4l2() override {
    for (auto& [data, size] : memory_) std::free(data);
  }

  // --- what a test does

  // From now on `call` (a request, or one of the above) fails `times` times with `error`, after so many calls that
  // work.
  void break_call(unsigned long call, int error, int after = 0, int times = INT_MAX) {
    std::lock_guard<std::mutex> lock(mutex_);
    faults_ = {{call, {error, after, times}}};
  }
  // The device is pulled out when `call` is made, after so many that still work.
  void vanish_at(unsigned long call, int after = 0) {
    std::lock_guard<std::mutex> lock(mutex_);
    faults_ = {{call, {0, after, 1}}};
  }
  // poll says that the device has an error, and nothing more.
  void raise_poll_error(bool on) {
    std::lock_guard<std::mutex> lock(mutex_);
    poll_error_ = on;
    wake();
  }
  // Sets the driver's timestamp of later frames; without one they get the time of delivery.
  void stamp_frames(std::optional<timeval> stamp) {
    std::lock_guard<std::mutex> lock(mutex_);
    stamp_ = stamp;
  }
  // Sets the offset that the driver reports from now on, for unchanged buffers.
  void set_data_offset(uint32_t offset) {
    std::lock_guard<std::mutex> lock(mutex_);
    said_offset_ = offset;
  }
  void add_to_index(uint32_t wrong) {
    std::lock_guard<std::mutex> lock(mutex_);
    wrong_index_ = wrong;
  }
  void number_frames_from(uint32_t sequence) {
    std::lock_guard<std::mutex> lock(mutex_);
    sequence_ = sequence;
  }
  void mend() {
    std::lock_guard<std::mutex> lock(mutex_);
    faults_.clear();
  }

  // Fills the next queued buffer with the byte `value`, of its second plane of memory with `value + 1`; false when none
  // is queued: the frame is lost, as in a driver. `bytes`: in each plane at most.
  bool deliver(uint8_t value, uint32_t flags = 0, size_t bytes = SIZE_MAX) {
    return fill(flags, bytes,
                [value](int plane, uint8_t* data, size_t size) { std::memset(data, value + plane, size); });
  }
  // The same with these bytes: a JPEG image.
  bool deliver(const std::vector<uint8_t>& jpeg) {
    return fill(0, jpeg.size(),
                [&](int, uint8_t* data, size_t size) { std::copy_n(jpeg.begin(), std::min(size, jpeg.size()), data); });
  }
  void unplug() {
    std::lock_guard<std::mutex> lock(mutex_);
    plugged_ = false;
    wake();
  }
  void plug(const std::string& path = "/dev/video0") {
    std::lock_guard<std::mutex> lock(mutex_);
    plugged_ = true;
    path_ = path;
  }
  // Files and mappings that are still open.
  int open_files() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return int(files_.size());
  }
  int mappings() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return mappings_;
  }
  // dma-bufs that are open.
  size_t exported() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return exported_.size();
  }
  int exports() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return exports_;
  }
  // The current value of a control in the driver.
  int control(uint32_t id) const {
    std::lock_guard<std::mutex> lock(mutex_);
    return controls.all.at(id).value;
  }
  void reset_controls() {
    std::lock_guard<std::mutex> lock(mutex_);
    for (auto& [id, control] : controls.all) control.value = control.preset;
  }
  size_t queued() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return queued_.size();
  }
  bool streaming() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return streaming_;
  }
  int opened() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return opened_;
  }
  double rate() const { return fps_; }

  // --- what the camera calls

  bool is_other_thing(const char*) override { return false; }
  int open(const char* path, int) override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (path != path_ || fails(kOpen)) return path != path_ ? failed(ENOENT) : -1;
    if (!plugged_) return failed(ENOENT);
    const int fd = eventfd(0, EFD_NONBLOCK | EFD_SEMAPHORE);
    files_.insert(fd);
    fd_ = fd;
    ++opened_;
    return fd;
  }

  int close(int fd) override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (exported_.erase(fd) != 0) return ::close(fd);
    if (files_.erase(fd) == 0) return failed(EBADF);
    streaming_ = false;
    queued_.clear();
    filled_.clear();
    return ::close(fd);
  }

  void* mmap(size_t length, int, off_t offset) override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (fails(kMmap)) return MAP_FAILED;
    void* data = std::calloc(length, 1);
    memory_[data] = length;
    buffers_[uint32_t(offset)] = static_cast<uint8_t*>(data);
    ++mappings_;
    return data;
  }

  int munmap(void* address, size_t length) override {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto found = memory_.find(address);
    if (found == memory_.end() || found->second != length) return failed(EINVAL);
    std::free(address);  // so that AddressSanitizer sees who reads it later
    memory_.erase(found);
    --mappings_;
    return 0;
  }

  int poll(pollfd* fds, nfds_t count, int timeout_ms) override {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (fails(kPoll)) return -1;
    }
    const int ready = ::poll(fds, count, timeout_ms);
    std::lock_guard<std::mutex> lock(mutex_);
    if (plugged_ && !poll_error_) return ready;
    fds[0].revents = plugged_ ? POLLERR : POLLERR | POLLHUP;
    return std::max(ready, 1);
  }

  int ioctl(int fd, unsigned long request, void* argument) override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (files_.count(fd) == 0) return failed(EBADF);
    if (fails(request)) return -1;
    if (!plugged_) return failed(ENODEV);
    switch (request) {
      case VIDIOC_QUERYCAP: return query(*static_cast<v4l2_capability*>(argument));
      case VIDIOC_ENUM_FMT: return describe(*static_cast<v4l2_fmtdesc*>(argument));
      case VIDIOC_TRY_FMT: return set_format(*static_cast<v4l2_format*>(argument), false);
      case VIDIOC_S_FMT: return set_format(*static_cast<v4l2_format*>(argument), true);
      case VIDIOC_ENUM_FRAMESIZES: return size(*static_cast<v4l2_frmsizeenum*>(argument));
      case VIDIOC_ENUM_FRAMEINTERVALS: return interval(*static_cast<v4l2_frmivalenum*>(argument));
      case VIDIOC_G_PARM: return rate_of(*static_cast<v4l2_streamparm*>(argument), false);
      case VIDIOC_S_PARM: return rate_of(*static_cast<v4l2_streamparm*>(argument), true);
      case VIDIOC_REQBUFS: return request_buffers(*static_cast<v4l2_requestbuffers*>(argument));
      case VIDIOC_QUERYBUF: return describe_buffer(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_QBUF: return queue(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_DQBUF: return dequeue(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_EXPBUF: return export_buffer(*static_cast<v4l2_exportbuffer*>(argument));
      case VIDIOC_STREAMON: streaming_ = true; return 0;
      case VIDIOC_STREAMOFF: streaming_ = false; return 0;
      case VIDIOC_QUERYCTRL: return answered(controls.query(*static_cast<v4l2_queryctrl*>(argument)));
      case VIDIOC_QUERYMENU: return answered(controls.query_item(*static_cast<v4l2_querymenu*>(argument)));
      case VIDIOC_G_CTRL: return answered(controls.get(*static_cast<v4l2_control*>(argument)));
      case VIDIOC_S_CTRL: return answered(controls.set(*static_cast<v4l2_control*>(argument)));
    }
    return failed(ENOTTY);
  }

 private:
  struct Fault {
    int error = 0;
    int after = 0;
    int times = 0;
  };
  struct Filled {
    uint32_t index, sequence, flags;
    size_t bytes;  // in each plane at most
    timeval time;
  };

  static int failed(int error) {
    errno = error;
    return -1;
  }
  bool fails(unsigned long call) {
    const auto found = faults_.find(call);
    if (found == faults_.end()) return false;
    Fault& fault = found->second;
    if (fault.after-- > 0 || fault.times <= 0) return false;
    --fault.times;
    if (fault.error == 0) {
      plugged_ = false;
      wake();
      return false;
    }
    errno = fault.error;
    return true;
  }
  static int answered(int error) { return error == 0 ? 0 : failed(error); }
  void wake() {
    const uint64_t one = 1;
    if (fd_ >= 0 && files_.count(fd_) != 0) [[maybe_unused]]
      const ssize_t written = ::write(fd_, &one, sizeof one);
  }
  template <class Fill>
  bool fill(uint32_t flags, size_t bytes, Fill fill_plane) {
    std::lock_guard<std::mutex> lock(mutex_);
    const uint32_t sequence = sequence_++;
    if (!streaming_ || queued_.empty()) return false;
    const uint32_t index = queued_.front();
    queued_.pop_front();
    for (int plane = 0; plane < memory_planes_; ++plane) {
      fill_plane(plane, buffers_[index + plane * kNextPlane] + data_offset[plane], memory_bytes_[plane]);
    }
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    // No two frames have the same time, however fast they come.
    last_us_ = std::max(last_us_ + 1, int64_t(now.tv_sec) * 1000000 + now.tv_nsec / 1000);
    const timeval time = stamp_.value_or(timeval{last_us_ / 1000000, last_us_ % 1000000});
    filled_.push_back({index, sequence, flags, bytes, time});
    wake();
    return true;
  }

  int query(v4l2_capability& found) {
    std::memcpy(found.card, "A camera in memory", 19);
    std::memcpy(found.bus_info, "memory", 7);
    found.capabilities = V4L2_CAP_DEVICE_CAPS | capabilities;
    found.device_caps =
        planar ? (capabilities & ~uint32_t(V4L2_CAP_VIDEO_CAPTURE)) | V4L2_CAP_VIDEO_CAPTURE_MPLANE : capabilities;
    return 0;
  }
  int describe(v4l2_fmtdesc& found) {
    std::vector<uint32_t> all;
    for (const Mode& mode : modes) {
      if (std::find(all.begin(), all.end(), mode.fourcc) == all.end()) all.push_back(mode.fourcc);
    }
    if (found.index >= all.size() && !endless) return failed(EINVAL);
    found.pixelformat = all[found.index % all.size()];
    return 0;
  }
  static size_t row_of(uint32_t fourcc, int width) {
    if (fourcc == V4L2_PIX_FMT_YUYV || fourcc == V4L2_PIX_FMT_Z16) return size_t(width) * 2;
    if (fourcc == V4L2_PIX_FMT_RGB24 || fourcc == V4L2_PIX_FMT_BGR24) return size_t(width) * 3;
    return size_t(width);
  }
  int set_format(v4l2_format& format, bool keep) {
    const uint32_t fourcc = planar ? format.fmt.pix_mp.pixelformat : format.fmt.pix.pixelformat;
    const int width = int(planar ? format.fmt.pix_mp.width : format.fmt.pix.width);
    const Mode* best = nullptr;
    for (const Mode& mode : modes) {
      if (mode.fourcc != fourcc) continue;
      if (best == nullptr || std::abs(mode.width - width) < std::abs(best->width - width)) best = &mode;
    }
    if (best == nullptr) return failed(EINVAL);
    const bool jpeg = fourcc == V4L2_PIX_FMT_MJPEG;
    const auto width_px = uint32_t(best->width), height_px = uint32_t(best->height);
    const size_t row = jpeg ? 0 : stride_bytes != 0 ? stride_bytes : row_of(fourcc, best->width);
    // The second plane of NV12M has longer lines, which reveals the use of one stride for both.
    const size_t rows[2] = {row, row + 32};
    size_t bytes[2] = {(jpeg ? 2 * width_px : row) * height_px, rows[1] * height_px / 2};
    if (fourcc == V4L2_PIX_FMT_NV12) bytes[0] += row * height_px / 2;
    const int planes = fourcc == V4L2_PIX_FMT_NV12M ? 2 : 1;
    if (planar) {
      v4l2_pix_format_mplane& mp = format.fmt.pix_mp;
      mp.width = width_px;
      mp.height = height_px;
      mp.num_planes = uint8_t(planes + wrong_planes);
      for (int plane = 0; plane < planes; ++plane) {
        mp.plane_fmt[plane].bytesperline = uint32_t(rows[plane]);
        mp.plane_fmt[plane].sizeimage = uint32_t(bytes[plane]);
      }
    } else {
      format.fmt.pix.width = width_px;
      format.fmt.pix.height = height_px;
      format.fmt.pix.bytesperline = uint32_t(row);
      format.fmt.pix.sizeimage = uint32_t(bytes[0]);
    }
    if (keep) {
      memory_planes_ = planes;
      std::copy(bytes, bytes + 2, memory_bytes_);
      fps_ = best->fps;
    }
    return 0;
  }
  int size(v4l2_frmsizeenum& found) {
    uint32_t index = found.index;
    for (const Mode& mode : modes) {
      if (mode.fourcc != found.pixel_format || (index-- > 0 && !endless)) continue;
      found.type = V4L2_FRMSIZE_TYPE_DISCRETE;
      found.discrete = {uint32_t(mode.width), uint32_t(mode.height)};
      return 0;
    }
    return failed(EINVAL);
  }
  int interval(v4l2_frmivalenum& found) {
    for (const Mode& mode : modes) {
      if ((found.index == 0 || endless) && mode.fourcc == found.pixel_format && mode.width == int(found.width)) {
        found.type = V4L2_FRMIVAL_TYPE_DISCRETE;
        found.discrete = {1, uint32_t(mode.fps)};
        return 0;
      }
    }
    return failed(EINVAL);
  }
  int rate_of(v4l2_streamparm& parameters, bool set) {
    v4l2_fract& period = parameters.parm.capture.timeperframe;
    if (set && period.numerator > 0) fps_ = double(period.denominator) / period.numerator;
    period = {1000, uint32_t(fps_ * 1000)};
    return 0;
  }
  int request_buffers(v4l2_requestbuffers& request) {
    if (granted_buffers != 0) request.count = granted_buffers;
    count_ = request.count;
    return 0;
  }
  uint32_t size_of_buffer(int plane) const {
    return buffer_bytes != 0 ? buffer_bytes : uint32_t(memory_bytes_[plane]) + data_offset[plane];
  }
  int describe_buffer(v4l2_buffer& buffer) {
    if (buffer.index >= count_ || (planar && buffer.length < uint32_t(memory_planes_))) return failed(EINVAL);
    for (int plane = 0; planar && plane < memory_planes_; ++plane) {
      buffer.m.planes[plane].length = size_of_buffer(plane);
      buffer.m.planes[plane].m.mem_offset = buffer.index + plane * kNextPlane;
    }
    if (!planar) {
      buffer.length = size_of_buffer(0);
      buffer.m.offset = buffer.index;
    }
    return 0;
  }
  int export_buffer(v4l2_exportbuffer& request) {
    if (!can_export) return failed(ENOTTY);
    if (request.index >= count_ || request.plane >= uint32_t(memory_planes_)) return failed(EINVAL);
    request.fd = memfd_create("a dma-buf", MFD_CLOEXEC);
    exported_.insert(request.fd);
    ++exports_;
    return 0;
  }
  int queue(v4l2_buffer& buffer) {
    if (buffer.index >= count_) return failed(EINVAL);
    if (std::find(queued_.begin(), queued_.end(), buffer.index) != queued_.end()) return failed(EINVAL);
    queued_.push_back(buffer.index);
    return 0;
  }
  int dequeue(v4l2_buffer& buffer) {
    uint64_t one = 0;
    if (filled_.empty() || ::read(fd_, &one, sizeof one) < 0) return failed(EAGAIN);
    const Filled filled = filled_.front();
    filled_.pop_front();
    buffer.index = filled.index + wrong_index_;
    buffer.sequence = filled.sequence;
    buffer.flags = filled.flags | timestamp_flags;
    buffer.timestamp = filled.time;
    for (int plane = 0; planar && plane < memory_planes_; ++plane) {
      buffer.m.planes[plane].data_offset = said_offset_.value_or(data_offset[plane]);
      buffer.m.planes[plane].bytesused =
          uint32_t(std::min(filled.bytes, memory_bytes_[plane])) + data_offset[plane];  // which counts both
    }
    if (!planar) buffer.bytesused = uint32_t(std::min(filled.bytes, memory_bytes_[0]));
    return 0;
  }

  static constexpr uint32_t kNextPlane = 1000;  // between the offsets of the planes of a buffer

  mutable std::mutex mutex_;
  std::map<unsigned long, Fault> faults_;
  std::set<int> files_;
  std::map<void*, size_t> memory_;
  std::map<uint32_t, uint8_t*> buffers_;
  std::deque<uint32_t> queued_;
  std::deque<Filled> filled_;
  int fd_ = -1;
  int mappings_ = 0;
  int opened_ = 0;
  uint32_t count_ = 0;
  uint32_t sequence_ = 0;
  int memory_planes_ = 1;
  size_t memory_bytes_[2] = {};  // of a frame in each plane of memory
  std::set<int> exported_;
  int exports_ = 0;
  bool poll_error_ = false;
  std::optional<timeval> stamp_;
  int64_t last_us_ = 0;
  uint32_t wrong_index_ = 0;
  std::optional<uint32_t> said_offset_;
  double fps_ = 30;
  bool plugged_ = true;
  std::string path_ = "/dev/video0";
  bool streaming_ = false;
};
