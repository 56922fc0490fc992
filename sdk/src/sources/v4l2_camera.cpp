#include "sources/v4l2_camera.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <mutex>
#include <optional>
#include <tuple>
#include <vector>

#include "core/error.h"

namespace maq {
namespace {

// What this build understands, the cheapest to use first.
struct KnownFormat {
  uint32_t fourcc;
  maq_pixel_format pixels;
  bool jpeg;
};
constexpr KnownFormat kKnownFormats[] = {
    {V4L2_PIX_FMT_NV12, MAQ_PIXEL_NV12, false},  {V4L2_PIX_FMT_YUYV, MAQ_PIXEL_YUYV, false},
    {V4L2_PIX_FMT_BGR24, MAQ_PIXEL_BGR8, false}, {V4L2_PIX_FMT_RGB24, MAQ_PIXEL_RGB8, false},
    {V4L2_PIX_FMT_GREY, MAQ_PIXEL_GREY8, false}, {V4L2_PIX_FMT_MJPEG, MAQ_PIXEL_BGR8, true},
    {V4L2_PIX_FMT_JPEG, MAQ_PIXEL_BGR8, true},
};
constexpr int kDefaultWidthPx = 640;
constexpr int kDefaultHeightPx = 480;
constexpr int kMostEnumerated = 256;  // a driver that never ends its list must not hold us

const KnownFormat* known_format(uint32_t fourcc) {
  for (const KnownFormat& format : kKnownFormats) {
    if (format.fourcc == fourcc) return &format;
  }
  return nullptr;
}

// Of a field of fixed size, which may lack the zero at its end.
std::string text_of(const uint8_t* bytes, size_t size) {
  const char* begin = reinterpret_cast<const char*>(bytes);
  return std::string(begin, strnlen(begin, size));
}

int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t(now.tv_sec) * 1000000000 + now.tv_nsec;
}

// The device is gone, or as good as: only opening it anew can help.
bool means_lost(int error) { return error == ENODEV || error == ENXIO || error == EIO || error == EBADF; }

class V4l2Camera : public Camera {
 public:
  V4l2Camera(SystemCalls& calls, std::string path) : calls_(calls), path_(std::move(path)) {}

  ~V4l2Camera() override {
    close();
    for (const Mapping& mapping : mappings_) calls_.munmap(mapping.data, mapping.size_bytes);
  }

  void start(const CameraWish& wish, int buffers) {
    open();
    negotiate(wish);
    make_buffers(buffers);
    int type = int(type_);
    if (call(VIDIOC_STREAMON, &type) != 0) fail("does not start", errno);
    streaming_ = true;
  }

  // What the device is and offers, without starting it. Throws what start() throws.
  void describe(CameraListing& listing) {
    open();
    listing.name = name_;
    listing.bus = bus_;
    listing.identity = identity_;
    for (uint32_t index = 0; index < kMostEnumerated; ++index) {
      v4l2_fmtdesc described{};
      described.index = index;
      described.type = type_;
      if (call(VIDIOC_ENUM_FMT, &described) != 0) break;
      list_sizes(described.pixelformat, listing.modes);
    }
  }

  const CameraFormat& format() const override { return format_; }
  const std::string& identity() const override { return identity_; }

  Event wait(int wake_fd, int timeout_ms, CameraBuffer& buffer, std::string& reason) override {
    pollfd fds[2] = {{fd_, POLLIN, 0}, {wake_fd, POLLIN, 0}};
    const int ready = calls_.poll(fds, 2, timeout_ms);
    if (ready < 0) {
      if (errno == EINTR) return Event::kTimeout;
      return lost("poll", errno, reason);
    }
    if ((fds[1].revents & POLLIN) != 0) return Event::kWoken;
    if (ready == 0) return Event::kTimeout;
    // An unplugged device is reported by errors alone, and dequeuing says which; a broken queue reports POLLERR only.
    v4l2_buffer filled{};
    v4l2_plane plane{};
    prepare(filled, plane);
    if (call(VIDIOC_DQBUF, &filled) != 0) {
      const int error = errno;
      if (error == EAGAIN && (fds[0].revents & (POLLERR | POLLHUP | POLLNVAL)) == 0) return Event::kTimeout;
      return lost("VIDIOC_DQBUF", error, reason);
    }
    if (filled.index >= mappings_.size()) {
      return lost("VIDIOC_DQBUF gave a buffer that does not exist;", EIO, reason);
    }
    const Mapping& mapping = mappings_[filled.index];
    const size_t used = is_planar_ ? plane.bytesused : filled.bytesused;
    const auto* data = static_cast<const uint8_t*>(mapping.data);
    const size_t size_bytes = std::min(used, mapping.size_bytes);
    if (format_.jpeg) {
      buffer.jpeg = data;
      buffer.jpeg_bytes = size_bytes;
    } else {
      buffer.image = {format_.pixels, format_.width_px, format_.height_px, {{data, stride_bytes_}, {}}};
      if (plane_count(format_.pixels) == 2) {
        buffer.image.planes[1] = {data + stride_bytes_ * size_t(format_.height_px), stride_bytes_};
      }
    }
    buffer.slot = int(filled.index);
    buffer.sequence = filled.sequence;
    buffer.damaged = (filled.flags & V4L2_BUF_FLAG_ERROR) != 0 || (!format_.jpeg && size_bytes < frame_bytes_);
    const bool is_monotonic = (filled.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    buffer.timestamp_ns = is_monotonic
                              ? int64_t(filled.timestamp.tv_sec) * 1000000000 + int64_t(filled.timestamp.tv_usec) * 1000
                              : monotonic_ns();
    return Event::kFrame;
  }

  void give_back(int slot) override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!streaming_) return;
    v4l2_buffer buffer{};
    v4l2_plane plane{};
    prepare(buffer, plane);
    buffer.index = uint32_t(slot);
    // Fails only when the device is gone, which the next wait() reports.
    call(VIDIOC_QBUF, &buffer);
  }

  void close() override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (fd_ < 0) return;
    if (streaming_) {
      int type = int(type_);
      call(VIDIOC_STREAMOFF, &type);
      streaming_ = false;
    }
    calls_.close(fd_);
    fd_ = -1;
  }

 private:
  struct Mapping {
    void* data;
    size_t size_bytes;
  };

  int call(unsigned long request, void* argument) {
    int result;
    do {
      result = calls_.ioctl(fd_, request, argument);
    } while (result < 0 && errno == EINTR);
    return result;
  }

  static Event lost(const char* call, int error, std::string& reason) {
    reason = concatenate(call, ": ", std::strerror(error));
    return Event::kLost;
  }

  // Closes the device, so that a failed start leaves nothing open, and throws what the error number means.
  [[noreturn]] void fail(const std::string& what, int error) {
    maq_status status = MAQ_ERROR_UNSUPPORTED;
    const char* remedy = "";
    switch (error) {
      case ENOENT:
        status = MAQ_ERROR_NOT_FOUND;
        remedy = " Is the camera plugged in, and is this its name?";
        break;
      case EACCES:
      case EPERM:
        status = MAQ_ERROR_NO_PERMISSION;
        remedy =
            " Cameras belong to the group \"video\": add the user to it (sudo usermod -aG video $USER), log in again.";
        break;
      case EBUSY:
        status = MAQ_ERROR_BUSY;
        remedy = " Another program uses the camera; close it.";
        break;
      case ENOSPC:
        status = MAQ_ERROR_BUSY;
        remedy = " The USB bus has no room left: ask for a smaller size or rate, or plug the camera in elsewhere.";
        break;
      case ENOMEM:
      case EAGAIN:
      case EMFILE:
      case ENFILE:
        status = MAQ_ERROR_OUT_OF_MEMORY;
        remedy = " Ask for a smaller size or fewer frames, or close other files.";
        break;
      default:
        if (means_lost(error)) {
          status = MAQ_ERROR_DEVICE_LOST;
          remedy = " The device is gone; plug it in again.";
        }
    }
    close();
    throw Error(status, path_, " ", what, ": ", std::strerror(error), ".", remedy);
  }

  // Opens the device and looks whether it is a camera that can stream.
  void open() {
    fd_ = calls_.open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0) fail("cannot be opened", errno);
    v4l2_capability found{};
    if (call(VIDIOC_QUERYCAP, &found) != 0) {
      if (errno == ENOTTY || errno == EINVAL) fail("is not a video device", errno);
      fail("does not tell what it can do", errno);
    }
    name_ = text_of(found.card, sizeof found.card);
    bus_ = text_of(found.bus_info, sizeof found.bus_info);
    identity_ = name_ + " at " + bus_;
    const uint32_t able = (found.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? found.device_caps : found.capabilities;
    is_planar_ = (able & V4L2_CAP_VIDEO_CAPTURE) == 0 && (able & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0;
    if ((able & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) == 0) {
      fail("captures no pictures (it is another kind of video device)", EINVAL);
    }
    if ((able & V4L2_CAP_STREAMING) == 0) fail("cannot stream into memory", EINVAL);
    type_ = is_planar_ ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  }

  v4l2_format format_request(uint32_t fourcc, int width, int height) const {
    v4l2_format request{};
    request.type = type_;
    if (is_planar_) {
      request.fmt.pix_mp.width = uint32_t(width);
      request.fmt.pix_mp.height = uint32_t(height);
      request.fmt.pix_mp.pixelformat = fourcc;
      request.fmt.pix_mp.field = V4L2_FIELD_NONE;
      request.fmt.pix_mp.num_planes = 1;
    } else {
      request.fmt.pix.width = uint32_t(width);
      request.fmt.pix.height = uint32_t(height);
      request.fmt.pix.pixelformat = fourcc;
      request.fmt.pix.field = V4L2_FIELD_NONE;
    }
    return request;
  }

  // Width, height, fourcc, bytes of a line and of an image of what the driver answered.
  struct Answer {
    int width, height;
    uint32_t fourcc;
    size_t stride_bytes, size_bytes;
    int planes;
  };
  Answer answer(const v4l2_format& from) const {
    if (is_planar_) {
      const v4l2_pix_format_mplane& mp = from.fmt.pix_mp;
      return {
          int(mp.width),     int(mp.height), mp.pixelformat, mp.plane_fmt[0].bytesperline, mp.plane_fmt[0].sizeimage,
          int(mp.num_planes)};
    }
    const v4l2_pix_format& pix = from.fmt.pix;
    return {int(pix.width), int(pix.height), pix.pixelformat, pix.bytesperline, pix.sizeimage, 1};
  }

  void list_sizes(uint32_t fourcc, std::vector<CameraMode>& modes) {
    char name[5] = {};
    std::memcpy(name, &fourcc, 4);
    for (uint32_t index = 0; index < kMostEnumerated; ++index) {
      v4l2_frmsizeenum size{};
      size.index = index;
      size.pixel_format = fourcc;
      if (call(VIDIOC_ENUM_FRAMESIZES, &size) != 0) break;
      const bool is_discrete = size.type == V4L2_FRMSIZE_TYPE_DISCRETE;
      const int width = int(is_discrete ? size.discrete.width : size.stepwise.max_width);
      const int height = int(is_discrete ? size.discrete.height : size.stepwise.max_height);
      modes.push_back(
          {name, known_format(fourcc) != nullptr, width, height, fastest_rate(fourcc, width, height).value_or(0)});
      if (!is_discrete) break;  // every size up to that one
    }
  }

  // The fastest rate at a size; nothing when the driver does not tell.
  std::optional<double> fastest_rate(uint32_t fourcc, int width, int height) {
    std::optional<double> best;
    for (uint32_t index = 0; index < kMostEnumerated; ++index) {
      v4l2_frmivalenum interval{};
      interval.index = index;
      interval.pixel_format = fourcc;
      interval.width = uint32_t(width);
      interval.height = uint32_t(height);
      if (call(VIDIOC_ENUM_FRAMEINTERVALS, &interval) != 0) break;
      const bool is_discrete = interval.type == V4L2_FRMIVAL_TYPE_DISCRETE;
      const v4l2_fract& shortest = is_discrete ? interval.discrete : interval.stepwise.min;
      if (shortest.numerator > 0) best = std::max(best.value_or(0), double(shortest.denominator) / shortest.numerator);
      if (!is_discrete) break;
    }
    return best;
  }

  // Of all formats that both sides know, the one nearest to the wished size, then fast enough, then cheapest to use.
  void negotiate(const CameraWish& wish) {
    const int width = wish.width_px > 0 ? wish.width_px : kDefaultWidthPx;
    const int height = wish.height_px > 0 ? wish.height_px : kDefaultHeightPx;
    struct Choice {
      double size_error, fps_missing;
      size_t order;
      uint32_t fourcc;
    };
    std::vector<Choice> choices;
    std::string offered;
    for (uint32_t index = 0; index < kMostEnumerated; ++index) {
      v4l2_fmtdesc described{};
      described.index = index;
      described.type = type_;
      if (call(VIDIOC_ENUM_FMT, &described) != 0) {
        if (means_lost(errno)) fail("was lost while its formats were read", errno);
        break;
      }
      char name[5] = {};
      std::memcpy(name, &described.pixelformat, 4);
      offered += (offered.empty() ? "" : ", ") + std::string(name);
      if (!wish.format.empty() && wish.format != name) continue;
      const KnownFormat* known = known_format(described.pixelformat);
      if (known == nullptr) continue;
      v4l2_format request = format_request(described.pixelformat, width, height);
      if (call(VIDIOC_TRY_FMT, &request) != 0) {
        if (means_lost(errno)) fail("was lost while its formats were read", errno);
        continue;
      }
      const Answer found = answer(request);
      if (found.fourcc != described.pixelformat || found.planes != 1) continue;
      const double size_error = std::abs(std::log(double(std::max(found.width, 1)) / width)) +
                                std::abs(std::log(double(std::max(found.height, 1)) / height));
      const double fps = fastest_rate(found.fourcc, found.width, found.height).value_or(1000);
      choices.push_back({size_error, std::max(0.0, (wish.fps > 0 ? wish.fps : 30) - fps), size_t(known - kKnownFormats),
                         found.fourcc});
    }
    if (choices.empty()) {
      fail(concatenate("offers ", offered.empty() ? "no format" : offered, ", but ",
                       wish.format.empty() ? "none of them is understood" : "not " + wish.format),
           EINVAL);
    }
    const Choice best = *std::min_element(choices.begin(), choices.end(), [](const Choice& a, const Choice& b) {
      return std::tie(a.size_error, a.fps_missing, a.order) < std::tie(b.size_error, b.fps_missing, b.order);
    });
    v4l2_format request = format_request(best.fourcc, width, height);
    if (call(VIDIOC_S_FMT, &request) != 0) fail("does not take its own format", errno);
    adopt(answer(request));
    set_rate(wish.fps);
  }

  // The driver has the last word, and what it says is checked before it is believed.
  void adopt(const Answer& agreed) {
    const KnownFormat* known = known_format(agreed.fourcc);
    const bool is_sane = known != nullptr && agreed.planes == 1 && agreed.width >= 1 && agreed.height >= 1 &&
                         agreed.width <= MAQ_MAX_SIDE_PX && agreed.height <= MAQ_MAX_SIDE_PX &&
                         int64_t(agreed.width) * agreed.height <= MAQ_MAX_PIXELS;
    if (!is_sane) {
      fail(concatenate("answered with a format that cannot be used (", agreed.width, " x ", agreed.height, ")"),
           EINVAL);
    }
    format_.pixels = known->pixels;
    format_.jpeg = known->jpeg;
    format_.width_px = agreed.width;
    format_.height_px = agreed.height;
    if (known->jpeg) return;
    const size_t row = row_bytes(known->pixels, 0, agreed.width);
    stride_bytes_ = agreed.stride_bytes == 0 ? row : agreed.stride_bytes;
    const size_t rows = size_t(agreed.height) + (known->pixels == MAQ_PIXEL_NV12 ? size_t(agreed.height + 1) / 2 : 0);
    frame_bytes_ = stride_bytes_ * rows;
    if (stride_bytes_ < row || stride_bytes_ > 16 * row) {
      fail(concatenate("answered with lines of ", stride_bytes_, " bytes for ", agreed.width, " pixels"), EINVAL);
    }
  }

  void set_rate(double fps) {
    v4l2_streamparm parameters{};
    parameters.type = type_;
    if (call(VIDIOC_G_PARM, &parameters) != 0) return;  // not every device has a rate
    if (fps > 0) {
      parameters.parm.capture.timeperframe = {1000, uint32_t(std::lround(fps * 1000))};
      if (call(VIDIOC_S_PARM, &parameters) != 0) return;
    }
    const v4l2_fract& period = parameters.parm.capture.timeperframe;
    if (period.numerator > 0) format_.fps = double(period.denominator) / period.numerator;
  }

  void prepare(v4l2_buffer& buffer, v4l2_plane& plane) const {
    buffer.type = type_;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (is_planar_) {
      buffer.m.planes = &plane;
      buffer.length = 1;
    }
  }

  void make_buffers(int count) {
    v4l2_requestbuffers request{};
    request.count = uint32_t(count);
    request.type = type_;
    request.memory = V4L2_MEMORY_MMAP;
    if (call(VIDIOC_REQBUFS, &request) != 0) fail("gives no buffers", errno);
    if (request.count < 2 || request.count > 256) {
      fail(concatenate("gives ", request.count, " buffers, of which at least 2 are needed"), EINVAL);
    }
    for (uint32_t index = 0; index < request.count; ++index) {
      v4l2_buffer buffer{};
      v4l2_plane plane{};
      prepare(buffer, plane);
      buffer.index = index;
      if (call(VIDIOC_QUERYBUF, &buffer) != 0) fail("does not describe its buffers", errno);
      const size_t size = is_planar_ ? plane.length : buffer.length;
      if (size < frame_bytes_ || size == 0) {
        fail(concatenate("has buffers of ", size, " bytes for images of ", frame_bytes_), EINVAL);
      }
      void* data = calls_.mmap(size, fd_, off_t(is_planar_ ? plane.m.mem_offset : buffer.m.offset));
      if (data == MAP_FAILED) fail("does not map its buffers into memory", errno);
      mappings_.push_back({data, size});
      if (call(VIDIOC_QBUF, &buffer) != 0) fail("takes no buffers", errno);
    }
  }

  SystemCalls& calls_;
  std::string path_;
  int fd_ = -1;
  v4l2_buf_type type_ = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  bool is_planar_ = false;
  CameraFormat format_;
  std::string name_, bus_, identity_;
  size_t frame_bytes_ = 0;   // of pixels as they come
  size_t stride_bytes_ = 0;  // of both planes
  std::vector<Mapping> mappings_;
  std::mutex mutex_;  // of fd_ and streaming_ between wait's thread and those who give frames back
  bool streaming_ = false;
};

}  // namespace

CameraOpener v4l2_opener(SystemCalls& calls, const std::string& path, CameraWish wish, int buffers) {
  return [&calls, path, wish = std::move(wish), buffers, identity = std::string()]() mutable {
    std::string place = path;
    if (!identity.empty()) {
      for (const CameraListing& listing : list_v4l2_cameras(calls)) {
        if (listing.identity == identity) place = listing.uri.substr(listing.uri.find(':') + 1);
      }
    }
    std::shared_ptr<Camera> camera = open_v4l2_camera(calls, place, wish, buffers);
    if (!identity.empty() && camera->identity() != identity) {
      camera->close();
      throw Error(MAQ_ERROR_DEVICE_LOST, path, " is ", camera->identity(), " now, but was ", identity, ".");
    }
    identity = camera->identity();
    return camera;
  };
}

std::vector<CameraListing> list_v4l2_cameras(SystemCalls& calls) {
  constexpr int kMostDevices = 64;
  std::vector<CameraListing> found;
  for (int number = 0; number < kMostDevices; ++number) {
    const std::string path = "/dev/video" + std::to_string(number);
    CameraListing listing;
    listing.uri = "v4l2:" + path;
    try {
      V4l2Camera(calls, path).describe(listing);
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

std::shared_ptr<Camera> open_v4l2_camera(SystemCalls& calls, const std::string& path, const CameraWish& wish,
                                         int buffers) {
  auto camera = std::make_shared<V4l2Camera>(calls, path);
  camera->start(wish, buffers);
  return camera;
}

}  // namespace maq
