// A camera driver in memory, for the calls of maq::SystemCalls: what Linux would do, and every way it may fail.
#pragma once

#include <linux/videodev2.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "sources/system_calls.h"

class FakeV4l2 : public maq::SystemCalls {
 public:
  struct Mode {
    uint32_t fourcc;
    int width, height;
    int fps;
  };
  // What the device offers; TRY_FMT takes the nearest size of a format.
  std::vector<Mode> modes = {{V4L2_PIX_FMT_YUYV, 640, 480, 30}, {V4L2_PIX_FMT_YUYV, 320, 240, 30}};
  bool planar = false;
  uint32_t capabilities = V4L2_CAP_STREAMING | V4L2_CAP_VIDEO_CAPTURE;
  uint32_t timestamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  static constexpr unsigned long kOpen = 0, kMmap = 1, kPoll = 2;
  // What the driver answers, changed by a test that plays a broken one.
  size_t stride_bytes = 0;       // 0: rows without padding
  uint32_t granted_buffers = 0;  // 0: as many as were asked for
  uint32_t buffer_bytes = 0;     // 0: as many as a frame has
  uint32_t wrong_index = 0;      // added to what DQBUF says

  ~FakeV4l2() override {
    for (auto& [data, size] : memory_) std::free(data);
  }

  // --- what a test does

  // From now on `call` (a request, or one of the above) fails with `error`, after so many calls that still work.
  void break_call(unsigned long call, int error, int after = 0) {
    std::lock_guard<std::mutex> lock(mutex_);
    faults_ = {{call, {error, after}}};
  }
  void mend() {
    std::lock_guard<std::mutex> lock(mutex_);
    faults_.clear();
  }

  // Fills the next queued buffer with the byte `value`; false when none is queued: the frame is lost, as in a driver.
  bool deliver(uint8_t value, uint32_t flags = 0, size_t bytes = SIZE_MAX) {
    std::lock_guard<std::mutex> lock(mutex_);
    const uint32_t sequence = sequence_++;
    if (!streaming_ || queued_.empty()) return false;
    const uint32_t index = queued_.front();
    queued_.pop_front();
    std::memset(buffers_[index], value, frame_bytes_);
    finish(index, sequence, flags, std::min(bytes, frame_bytes_));
    return true;
  }
  // The same with these bytes: a JPEG image.
  bool deliver(const std::vector<uint8_t>& bytes) {
    std::lock_guard<std::mutex> lock(mutex_);
    const uint32_t sequence = sequence_++;
    if (!streaming_ || queued_.empty()) return false;
    const uint32_t index = queued_.front();
    queued_.pop_front();
    std::memcpy(buffers_[index], bytes.data(), std::min(bytes.size(), frame_bytes_));
    finish(index, sequence, 0, std::min(bytes.size(), frame_bytes_));
    return true;
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
  // Files and mappings that somebody has not closed.
  int open_files() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return int(files_.size());
  }
  int mappings() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return mappings_;
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

  int open(const char* path, int) override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!plugged_ || path != path_) return failed(ENOENT);
    if (fails(kOpen)) return -1;
    const int fd = eventfd(0, EFD_NONBLOCK | EFD_SEMAPHORE);
    files_.insert(fd);
    fd_ = fd;
    ++opened_;
    return fd;
  }

  int close(int fd) override {
    std::lock_guard<std::mutex> lock(mutex_);
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
    if (plugged_) return ready;
    fds[0].revents = POLLERR | POLLHUP;
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
      case VIDIOC_STREAMON: streaming_ = true; return 0;
      case VIDIOC_STREAMOFF: streaming_ = false; return 0;
    }
    return failed(ENOTTY);
  }

 private:
  struct Fault {
    int error = 0;
    int after = 0;
  };
  struct Filled {
    uint32_t index, sequence, flags;
    size_t bytes;
    timeval time;
  };

  static int failed(int error) {
    errno = error;
    return -1;
  }
  bool fails(unsigned long call) {
    const auto found = faults_.find(call);
    if (found == faults_.end()) return false;
    if (found->second.after-- > 0) return false;
    errno = found->second.error;
    return true;
  }
  void wake() {
    const uint64_t one = 1;
    if (fd_ >= 0 && files_.count(fd_) != 0) [[maybe_unused]]
      const ssize_t written = ::write(fd_, &one, sizeof one);
  }
  void finish(uint32_t index, uint32_t sequence, uint32_t flags, size_t bytes) {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    filled_.push_back({index, sequence, flags, bytes, {now.tv_sec, now.tv_nsec / 1000}});
    wake();
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
    if (found.index >= all.size()) return failed(EINVAL);
    found.pixelformat = all[found.index];
    return 0;
  }
  static size_t row_of(uint32_t fourcc, int width) {
    if (fourcc == V4L2_PIX_FMT_YUYV) return size_t(width) * 2;
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
    const size_t row = jpeg ? 0 : stride_bytes != 0 ? stride_bytes : row_of(fourcc, best->width);
    size_t bytes = jpeg ? size_t(best->width) * size_t(best->height) * 2 : row * size_t(best->height);
    if (fourcc == V4L2_PIX_FMT_NV12) bytes += row * size_t(best->height) / 2;
    if (planar) {
      format.fmt.pix_mp.width = uint32_t(best->width);
      format.fmt.pix_mp.height = uint32_t(best->height);
      format.fmt.pix_mp.num_planes = 1;
      format.fmt.pix_mp.plane_fmt[0].bytesperline = uint32_t(row);
      format.fmt.pix_mp.plane_fmt[0].sizeimage = uint32_t(bytes);
    } else {
      format.fmt.pix.width = uint32_t(best->width);
      format.fmt.pix.height = uint32_t(best->height);
      format.fmt.pix.bytesperline = uint32_t(row);
      format.fmt.pix.sizeimage = uint32_t(bytes);
    }
    if (keep) {
      frame_bytes_ = bytes;
      fps_ = best->fps;
    }
    return 0;
  }
  int size(v4l2_frmsizeenum& found) {
    uint32_t index = found.index;
    for (const Mode& mode : modes) {
      if (mode.fourcc != found.pixel_format || index-- > 0) continue;
      found.type = V4L2_FRMSIZE_TYPE_DISCRETE;
      found.discrete = {uint32_t(mode.width), uint32_t(mode.height)};
      return 0;
    }
    return failed(EINVAL);
  }
  int interval(v4l2_frmivalenum& found) {
    for (const Mode& mode : modes) {
      if (found.index == 0 && mode.fourcc == found.pixel_format && mode.width == int(found.width)) {
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
  uint32_t size_of_buffer() const { return buffer_bytes != 0 ? buffer_bytes : uint32_t(frame_bytes_); }
  int describe_buffer(v4l2_buffer& buffer) {
    if (buffer.index >= count_) return failed(EINVAL);
    if (planar) {
      buffer.m.planes[0].length = size_of_buffer();
      buffer.m.planes[0].m.mem_offset = buffer.index;
    } else {
      buffer.length = size_of_buffer();
      buffer.m.offset = buffer.index;
    }
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
    buffer.index = filled.index + wrong_index;
    buffer.sequence = filled.sequence;
    buffer.flags = filled.flags | timestamp_flags;
    buffer.timestamp = filled.time;
    (planar ? buffer.m.planes[0].bytesused : buffer.bytesused) = uint32_t(filled.bytes);
    return 0;
  }

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
  size_t frame_bytes_ = 0;
  double fps_ = 30;
  bool plugged_ = true;
  std::string path_ = "/dev/video0";
  bool streaming_ = false;
};
