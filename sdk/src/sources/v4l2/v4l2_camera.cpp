#include "sources/v4l2/v4l2_camera.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <mutex>
#include <tuple>
#include <utility>
#include <vector>

#include "core/checked_arithmetic.h"
#include "core/clock.h"
#include "core/error.h"
#include "sources/calibration_options.h"
#include "sources/camera_errors.h"
#include "sources/control_options.h"
#include "sources/v4l2/v4l2_controls.h"
#include "sources/v4l2/v4l2_device.h"

namespace maq {
namespace {

constexpr int64_t kSecondNs = 1000000000;
constexpr int64_t kMaxStampAgeNs = 10 * kSecondNs;

// When the driver says that the image was taken. When it arrived, where that cannot be: a stamp of another clock, in
// the future, or older than frames in a queue become.
int64_t time_of(const v4l2_buffer& filled) {
  const int64_t now = monotonic_ns();
  const int64_t seconds = filled.timestamp.tv_sec, microseconds = filled.timestamp.tv_usec;
  const bool is_monotonic = (filled.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (!is_monotonic || seconds < 0 || seconds > now / kSecondNs || microseconds < 0 || microseconds > 999999)
    return now;
  const int64_t stamp = seconds * kSecondNs + microseconds * 1000;
  return stamp > now || stamp < now - kMaxStampAgeNs ? now : stamp;
}

class V4l2Camera final : public Camera {
 public:
  V4l2Camera(SystemCalls& calls, const std::string& path)
      : calls_(calls), device_(std::make_shared<V4l2Device>(calls, path)), identity_(device_->identity()) {}

  ~V4l2Camera() override {
    close();
    for (const Slot& slot : slots_) {
      if (slot.dma_buf >= 0) calls_.close(slot.dma_buf);
      for (const Mapping& plane : slot.planes) {
        if (plane.data != nullptr) calls_.munmap(plane.data, plane.size_bytes);
      }
    }
  }

  void start(const CameraRequest& request, int buffers) {
    depth_unit_m_ = request.depth_unit_m;
    negotiate(request);
    make_buffers(buffers);
    int type = int(device_->buffer_type());
    if (device_->call(VIDIOC_STREAMON, &type) != 0) device_->fail("does not start", errno);
    streaming_ = true;
  }

  const CameraFormat& format() const override { return format_; }
  const std::string& identity() const override { return identity_; }

  maq_source_control_info control(maq_source_control which) override {
    return read_v4l2_control(*open_device(), which);
  }
  void set_control(maq_source_control which, double value) override {
    write_v4l2_control(*open_device(), which, value);
  }

  Event wait(int wake_fd, int timeout_ms, CameraBuffer& buffer, std::string& reason) override {
    if (const int error = queue_error_) return lost("VIDIOC_QBUF", error, reason);
    pollfd fds[2] = {{device_->fd(), POLLIN, 0}, {wake_fd, POLLIN, 0}};
    const int ready = calls_.poll(fds, 2, timeout_ms);
    if (ready < 0) {
      if (errno == EINTR) return Event::kTimeout;
      return lost("poll", errno, reason);
    }
    if ((fds[1].revents & POLLIN) != 0) return Event::kWoken;
    if (ready == 0) return Event::kTimeout;
    // An unplugged device is reported by errors alone, and dequeuing says which; a broken queue reports POLLERR only.
    v4l2_buffer filled{};
    v4l2_plane planes[VIDEO_MAX_PLANES] = {};
    prepare(filled, planes);
    if (device_->call(VIDIOC_DQBUF, &filled) != 0) {
      const int error = errno;
      if (error == EAGAIN && (fds[0].revents & (POLLERR | POLLHUP | POLLNVAL)) == 0) return Event::kTimeout;
      return lost("VIDIOC_DQBUF", error, reason);
    }
    if (filled.index >= slots_.size() || !take(slots_[filled.index])) {
      return lost("VIDIOC_DQBUF gave a buffer that does not exist or is held;", EIO, reason);
    }
    buffer.slot = int(filled.index);
    buffer.sequence = filled.sequence;
    buffer.timestamp_ns = time_of(filled);
    const bool is_whole = show(filled, planes, buffer);
    buffer.damaged = !is_whole || (filled.flags & V4L2_BUF_FLAG_ERROR) != 0;
    return Event::kFrame;
  }

  void give_back(int slot) override {
    std::lock_guard<std::mutex> lock(mutex_);
    slots_[size_t(slot)].is_held = false;
    if (!streaming_) return;
    v4l2_buffer buffer{};
    v4l2_plane planes[VIDEO_MAX_PLANES] = {};
    prepare(buffer, planes);
    buffer.index = uint32_t(slot);
    // Reported by the next wait(): a camera that loses its buffers one by one would end up without any.
    if (device_->call(VIDIOC_QBUF, &buffer) != 0) queue_error_ = errno;
  }

  int dma_buf(int index) override {
    std::lock_guard<std::mutex> lock(mutex_);
    Slot& slot = slots_[size_t(index)];
    // The app could not know where in a dma-buf the image begins, or which is the other one.
    if (known_->memory_planes != 1 || slot.begins_at != 0) return -1;
    if (slot.dma_buf < 0 && device_ != nullptr) {
      v4l2_exportbuffer request{};
      request.type = device_->buffer_type();
      request.index = uint32_t(index);
      request.flags = O_RDONLY | O_CLOEXEC;
      request.fd = -1;
      if (device_->call(VIDIOC_EXPBUF, &request) == 0) slot.dma_buf = std::max(request.fd, -1);
    }
    return slot.dma_buf;
  }

  void close() override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (device_ == nullptr) return;
    if (streaming_) {
      int type = int(device_->buffer_type());
      device_->call(VIDIOC_STREAMOFF, &type);
      streaming_ = false;
    }
    device_.reset();
  }

 private:
  struct Mapping {
    void* data = nullptr;
    size_t size_bytes = 0;
  };
  struct Slot {
    Mapping planes[2];
    size_t begins_at = 0;  // the image that it holds, in bytes from its beginning
    int dma_buf = -1;
    bool is_held = false;  // until give_back()
  };

  static Event lost(const char* call, int error, std::string& reason) {
    reason = concatenate(call, ": ", std::strerror(error));
    return Event::kLost;
  }

  // Marks the buffer as held; false when it is already.
  bool take(Slot& slot) {
    std::lock_guard<std::mutex> lock(mutex_);
    return !std::exchange(slot.is_held, true);
  }

  // Shared, so that a slow control does not hold the lock, which returning a frame needs: the last owner closes the
  // device.
  std::shared_ptr<const V4l2Device> open_device() {
    std::lock_guard<std::mutex> lock(mutex_);
    if (device_ == nullptr) throw Error(MAQ_ERROR_DEVICE_LOST, identity_, " is closed; plug it in again.");
    return device_;
  }

  v4l2_format format_request(const V4l2Format& format, int width_px, int height_px) const {
    v4l2_format request{};
    request.type = device_->buffer_type();
    if (device_->is_planar()) {
      request.fmt.pix_mp.width = uint32_t(width_px);
      request.fmt.pix_mp.height = uint32_t(height_px);
      request.fmt.pix_mp.pixelformat = format.fourcc;
      request.fmt.pix_mp.field = V4L2_FIELD_NONE;
      request.fmt.pix_mp.num_planes = uint8_t(format.memory_planes);
    } else {
      request.fmt.pix.width = uint32_t(width_px);
      request.fmt.pix.height = uint32_t(height_px);
      request.fmt.pix.pixelformat = format.fourcc;
      request.fmt.pix.field = V4L2_FIELD_NONE;
    }
    return request;
  }

  // The driver's answer, by either interface.
  struct Answer {
    int width_px, height_px;
    uint32_t fourcc;
    int memory_planes;
    size_t stride_bytes[2];
  };
  Answer answer(const v4l2_format& from) const {
    if (device_->is_planar()) {
      const v4l2_pix_format_mplane& mp = from.fmt.pix_mp;
      return {int(mp.width),
              int(mp.height),
              mp.pixelformat,
              int(mp.num_planes),
              {mp.plane_fmt[0].bytesperline, mp.plane_fmt[1].bytesperline}};
    }
    const v4l2_pix_format& pix = from.fmt.pix;
    return {int(pix.width), int(pix.height), pix.pixelformat, 1, {pix.bytesperline, pix.bytesperline}};
  }

  // Chooses among the formats that both sides know the one nearest to the wanted size, then fast enough, then cheapest
  // to use.
  void negotiate(const CameraRequest& request) {
    const int width = request.width_px > 0 ? request.width_px : kDefaultCameraWidthPx;
    const int height = request.height_px > 0 ? request.height_px : kDefaultCameraHeightPx;
    struct Choice {
      double size_error, fps_missing;
      const V4l2Format* format;
    };
    std::vector<Choice> choices;
    std::string offered;
    bool offers_depth = false;
    for (const uint32_t fourcc : device_->formats()) {
      const std::string name = fourcc_name(fourcc);
      offered += (offered.empty() ? "" : ", ") + name;
      const V4l2Format* known = known_v4l2_format(fourcc);
      if (known == nullptr || (!request.format.empty() && request.format != name)) continue;
      const bool shows_depth = is_depth(known->pixels);
      offers_depth = offers_depth || shows_depth;
      // Depth must be requested: most apps want colour images.
      if (shows_depth && request.format.empty()) continue;
      v4l2_format tried = format_request(*known, width, height);
      if (device_->call(VIDIOC_TRY_FMT, &tried) != 0) {
        if (is_device_lost(errno)) device_->fail("was lost while its formats were read", errno);
        continue;
      }
      const Answer found = answer(tried);
      if (found.fourcc != fourcc || found.memory_planes != known->memory_planes) continue;
      const double size_error = std::abs(std::log(double(std::max(found.width_px, 1)) / width)) +
                                std::abs(std::log(double(std::max(found.height_px, 1)) / height));
      const double fps = device_->fastest_rate(fourcc, found.width_px, found.height_px).value_or(1000);
      choices.push_back({size_error, std::max(0.0, (request.fps > 0 ? request.fps : 30) - fps), known});
    }
    if (choices.empty()) {
      device_->fail(concatenate("offers ", offered.empty() ? "no format" : offered, ", but ",
                                !request.format.empty() ? "not " + request.format
                                : offers_depth          ? "all of them are depth; open depth with format=Z16"
                                                        : "none of them is understood"),
                    EINVAL);
    }
    const Choice best = *std::min_element(choices.begin(), choices.end(), [](const Choice& a, const Choice& b) {
      return std::tie(a.size_error, a.fps_missing, a.format) < std::tie(b.size_error, b.fps_missing, b.format);
    });
    v4l2_format chosen = format_request(*best.format, width, height);
    if (device_->call(VIDIOC_S_FMT, &chosen) != 0) device_->fail("does not take its own format", errno);
    adopt(answer(chosen));
    set_rate(request.fps);
  }

  // The driver decides, and its answer is checked before it is used.
  void adopt(const Answer& agreed) {
    known_ = known_v4l2_format(agreed.fourcc);
    const bool is_sane = known_ != nullptr && agreed.memory_planes == known_->memory_planes && agreed.width_px >= 1 &&
                         agreed.height_px >= 1 && agreed.width_px <= MAQ_MAX_SIDE_PX &&
                         agreed.height_px <= MAQ_MAX_SIDE_PX &&
                         int64_t(agreed.width_px) * agreed.height_px <= MAQ_MAX_PIXELS;
    if (!is_sane) {
      device_->fail(
          concatenate("answered with a format that cannot be used (", agreed.width_px, " x ", agreed.height_px, ")"),
          EINVAL);
    }
    format_.pixels = known_->pixels;
    format_.jpeg = known_->jpeg;
    format_.width_px = agreed.width_px;
    format_.height_px = agreed.height_px;
    memory_bytes_[0] = memory_bytes_[1] = 1;
    if (format_.jpeg) return;
    std::optional<size_t> whole_bytes = 0;
    for (int plane = 0; plane < plane_count(format_.pixels); ++plane) {
      const size_t row = row_bytes(format_.pixels, plane, format_.width_px);
      // Planes in the same memory have the same stride.
      const size_t said = agreed.stride_bytes[known_->memory_planes == 1 ? 0 : plane];
      stride_bytes_[plane] = said == 0 ? row : said;
      if (stride_bytes_[plane] < row || stride_bytes_[plane] > 16 * row) {
        device_->fail(concatenate("answered with lines of ", said, " bytes for ", format_.width_px, " pixels"), EINVAL);
      }
      const auto bytes =
          checked_product(stride_bytes_[plane], size_t(plane_rows(format_.pixels, plane, format_.height_px)));
      if (whole_bytes) whole_bytes = bytes ? checked_sum(*whole_bytes, *bytes) : bytes;
      if (!whole_bytes) device_->fail(concatenate("answered with lines of ", said, " bytes, too many to map"), EINVAL);
      memory_bytes_[plane] = *bytes;
    }
    if (known_->memory_planes == 1) memory_bytes_[0] = *whole_bytes;
  }

  void set_rate(double fps) {
    v4l2_streamparm found{};
    found.type = device_->buffer_type();
    if (device_->call(VIDIOC_G_PARM, &found) != 0) return;  // not every device has a rate
    if (fps > 0) {
      v4l2_streamparm wanted = found;
      wanted.parm.capture.timeperframe = {1000, uint32_t(std::lround(fps * 1000))};
      if (device_->call(VIDIOC_S_PARM, &wanted) == 0) found = wanted;
    }
    const v4l2_fract& period = found.parm.capture.timeperframe;
    if (period.numerator > 0) format_.fps = double(period.denominator) / period.numerator;
  }

  void prepare(v4l2_buffer& buffer, v4l2_plane* planes) const {
    buffer.type = device_->buffer_type();
    buffer.memory = V4L2_MEMORY_MMAP;
    if (device_->is_planar()) {
      buffer.m.planes = planes;
      buffer.length = uint32_t(known_->memory_planes);
    }
  }

  void make_buffers(int count) {
    v4l2_requestbuffers request{};
    request.count = uint32_t(count);
    request.type = device_->buffer_type();
    request.memory = V4L2_MEMORY_MMAP;
    if (device_->call(VIDIOC_REQBUFS, &request) != 0) device_->fail("gives no buffers", errno);
    if (request.count < 2 || request.count > 256) {
      device_->fail(concatenate("gives ", request.count, " buffers, of which 2 to 256 can be used"), EINVAL);
    }
    slots_.resize(request.count);
    for (uint32_t index = 0; index < request.count; ++index) {
      v4l2_buffer buffer{};
      v4l2_plane planes[VIDEO_MAX_PLANES] = {};
      prepare(buffer, planes);
      buffer.index = index;
      if (device_->call(VIDIOC_QUERYBUF, &buffer) != 0) device_->fail("does not describe its buffers", errno);
      for (int plane = 0; plane < known_->memory_planes; ++plane) {
        const bool is_planar = device_->is_planar();
        const size_t size = is_planar ? planes[plane].length : buffer.length;
        if (size < memory_bytes_[plane]) {
          device_->fail(concatenate("has buffers of ", size, " bytes for images of ", memory_bytes_[plane]), EINVAL);
        }
        const off_t offset = is_planar ? planes[plane].m.mem_offset : buffer.m.offset;
        void* data = calls_.mmap(size, device_->fd(), offset);
        if (data == MAP_FAILED) device_->fail("does not map its buffers into memory", errno);
        slots_[index].planes[plane] = {data, size};
      }
      buffer.index = index;
      if (device_->call(VIDIOC_QBUF, &buffer) != 0) device_->fail("takes no buffers", errno);
    }
  }

  // Points `buffer` at the memory that the driver filled; false if there are fewer pixels than agreed.
  bool show(const v4l2_buffer& filled, const v4l2_plane* planes, CameraBuffer& buffer) {
    Slot& slot = slots_[filled.index];
    const uint8_t* data[2] = {};
    size_t bytes[2] = {};
    bool is_whole = true;
    for (int plane = 0; plane < known_->memory_planes; ++plane) {
      const Mapping& mapping = slot.planes[plane];
      const size_t said = device_->is_planar() ? planes[plane].bytesused : filled.bytesused;
      const size_t used = std::min(said, mapping.size_bytes);
      // data_offset is counted in bytesused.
      const size_t offset = device_->is_planar() ? std::min<size_t>(planes[plane].data_offset, used) : 0;
      data[plane] = static_cast<const uint8_t*>(mapping.data) + offset;
      bytes[plane] = used - offset;
      is_whole = is_whole && bytes[plane] >= memory_bytes_[plane];
      if (plane == 0) slot.begins_at = offset;
    }
    buffer.image = {format_.pixels, format_.width_px, format_.height_px, {}};
    buffer.depth_unit_m = depth_unit_m_;
    if (format_.jpeg) {
      buffer.jpeg = data[0];
      buffer.jpeg_bytes = bytes[0];
      return is_whole;
    }
    buffer.image.planes[0] = {data[0], stride_bytes_[0]};
    if (known_->memory_planes == 2) {
      buffer.image.planes[1] = {data[1], stride_bytes_[1]};
    } else if (is_whole && plane_count(format_.pixels) == 2) {
      buffer.image.planes[1] = {data[0] + stride_bytes_[0] * size_t(format_.height_px), stride_bytes_[1]};
    }
    return is_whole;
  }

  SystemCalls& calls_;
  std::shared_ptr<const V4l2Device> device_;  // null when closed, by wait's thread alone
  std::string identity_;
  const V4l2Format* known_ = nullptr;
  CameraFormat format_;
  double depth_unit_m_ = kMillimetre;
  size_t stride_bytes_[2] = {};  // stride of each plane of the image
  size_t memory_bytes_[2] = {};  // memory of an image in each plane
  std::vector<Slot> slots_;
  std::mutex mutex_;  // guards device_, streaming_, is_held and dma_buf
  bool streaming_ = false;
  std::atomic<int> queue_error_{0};
};

}  // namespace

CameraOpener v4l2_uri_opener(SourceUri uri, int buffers, const Log&) {
  CameraRequest request{uri.take_text("format"), uri.width_px, uri.height_px, uri.fps};
  request.depth_unit_m = take_depth_unit(uri).value_or(kMillimetre);
  uri.expect_no_more_options(
      concatenate("size, fps, format, depth_unit, ", kCalibrationOptions, ", ", kControlOptions));
  const bool is_number = uri.target.find_first_not_of("0123456789") == std::string::npos;
  const std::string path = is_number ? "/dev/video" + uri.target : uri.target;
  return v4l2_opener(SystemCalls::real(), path, std::move(request), buffers);
}

CameraOpener v4l2_opener(SystemCalls& calls, const std::string& path, CameraRequest request, int buffers) {
  return [&calls, path, request = std::move(request), buffers, identity = std::string()]() mutable {
    std::string path_now = path;
    if (!identity.empty()) {
      for (const CameraListing& listing : list_v4l2_cameras(calls)) {
        if (listing.identity == identity) path_now = listing.uri.substr(listing.uri.find(':') + 1);
      }
    }
    std::shared_ptr<Camera> camera = open_v4l2_camera(calls, path_now, request, buffers);
    if (!identity.empty() && camera->identity() != identity) {
      camera->close();
      throw Error(MAQ_ERROR_DEVICE_LOST, path, " is ", camera->identity(), " now, but was ", identity, ".");
    }
    identity = camera->identity();
    return camera;
  };
}

std::vector<CameraListing> list_v4l2_cameras(SystemCalls& calls) {
  constexpr int kMaxDevices = 64;
  std::vector<CameraListing> found;
  for (int number = 0; number < kMaxDevices; ++number) {
    const std::string path = "/dev/video" + std::to_string(number);
    CameraListing listing;
    listing.uri = "v4l2:" + path;
    try {
      const V4l2Device device(calls, path);
      listing.name = device.name();
      listing.bus = device.bus();
      listing.identity = device.identity();
      listing.modes = device.modes();
    } catch (const Error& error) {
      // Encoders, decoders and metadata have such files as well.
      if (error.status() == MAQ_ERROR_NOT_FOUND || error.status() == MAQ_ERROR_UNSUPPORTED) continue;
      listing.status = error.status();
      listing.problem = error.what();
    }
    found.push_back(std::move(listing));
  }
  return found;
}

std::shared_ptr<Camera> open_v4l2_camera(SystemCalls& calls, const std::string& path, const CameraRequest& request,
                                         int buffers) {
  auto camera = std::make_shared<V4l2Camera>(calls, path);
  camera->start(request, buffers);
  return camera;
}

}  // namespace maq
