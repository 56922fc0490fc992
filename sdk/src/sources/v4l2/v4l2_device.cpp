#include "sources/v4l2/v4l2_device.h"

#include <fcntl.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "sources/camera_errors.h"

namespace maq {
namespace {

constexpr V4l2Format kKnownFormats[] = {
    {V4L2_PIX_FMT_NV12, MAQ_PIXEL_NV12, false, 1},   {V4L2_PIX_FMT_NV12M, MAQ_PIXEL_NV12, false, 2},
    {V4L2_PIX_FMT_YUYV, MAQ_PIXEL_YUYV, false, 1},   {V4L2_PIX_FMT_BGR24, MAQ_PIXEL_BGR8, false, 1},
    {V4L2_PIX_FMT_RGB24, MAQ_PIXEL_RGB8, false, 1},  {V4L2_PIX_FMT_GREY, MAQ_PIXEL_GREY8, false, 1},
    {V4L2_PIX_FMT_MJPEG, MAQ_PIXEL_BGR8, true, 1},   {V4L2_PIX_FMT_JPEG, MAQ_PIXEL_BGR8, true, 1},
    {V4L2_PIX_FMT_Z16, MAQ_PIXEL_DEPTH16, false, 1},
};
// Against a driver whose lists never end, or whose calls are interrupted again and again.
constexpr int kMaxEnumerated = 256;
constexpr int kMaxInterruptions = 1000;

// Reads a field of fixed size, which may lack the zero at its end.
std::string text_of(const uint8_t* bytes, size_t size) {
  const char* begin = reinterpret_cast<const char*>(bytes);
  return std::string(begin, strnlen(begin, size));
}

template <class Call>
int repeated(Call call) {
  for (int interruptions = 0;; ++interruptions) {
    const int result = call();
    if (result >= 0 || errno != EINTR || interruptions == kMaxInterruptions) return result;
  }
}

}  // namespace

const V4l2Format* known_v4l2_format(uint32_t fourcc) {
  for (const V4l2Format& format : kKnownFormats) {
    if (format.fourcc == fourcc) return &format;
  }
  return nullptr;
}

std::string fourcc_name(uint32_t fourcc) {
  char name[5] = {};
  std::memcpy(name, &fourcc, 4);
  for (int last = 3; last > 0 && name[last] == ' '; --last) name[last] = 0;
  return name;
}

V4l2Device::V4l2Device(SystemCalls& calls, std::string path) : calls_(calls), path_(std::move(path)) {
  if (calls_.is_other_thing(path_.c_str())) {
    refuse_camera(path_, "is not a video device; name a camera, as in v4l2:/dev/video0");
  }
  fd_ = repeated([&] { return calls_.open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC); });
  if (fd_ < 0) fail("cannot be opened", errno);
  try {
    query_capabilities();
  } catch (...) {
    calls_.close(fd_);
    throw;
  }
}

V4l2Device::~V4l2Device() { calls_.close(fd_); }

void V4l2Device::query_capabilities() {
  v4l2_capability found{};
  if (call(VIDIOC_QUERYCAP, &found) != 0) {
    if (errno == ENOTTY || errno == EINVAL) fail("is not a video device", errno);
    fail("does not report its capabilities", errno);
  }
  name_ = text_of(found.card, sizeof found.card);
  bus_ = text_of(found.bus_info, sizeof found.bus_info);
  identity_ = name_ + " at " + bus_;
  const uint32_t able = (found.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? found.device_caps : found.capabilities;
  if ((able & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) == 0) {
    fail("captures no images (it is another kind of video device)", EINVAL);
  }
  if ((able & V4L2_CAP_STREAMING) == 0) fail("cannot stream into memory", EINVAL);
  is_planar_ = (able & V4L2_CAP_VIDEO_CAPTURE) == 0;
  buffer_type_ = is_planar_ ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
}

int V4l2Device::call(unsigned long request, void* argument) const {
  return repeated([&] { return calls_.ioctl(fd_, request, argument); });
}

void V4l2Device::fail(const std::string& what, int error) const { fail_camera(path_, what, error); }

std::vector<uint32_t> V4l2Device::formats() const {
  std::vector<uint32_t> found;
  for (uint32_t index = 0; index < kMaxEnumerated; ++index) {
    v4l2_fmtdesc described{};
    described.index = index;
    described.type = buffer_type_;
    if (call(VIDIOC_ENUM_FMT, &described) != 0) {
      if (is_device_lost(errno)) fail("was lost while its formats were read", errno);
      break;
    }
    found.push_back(described.pixelformat);
  }
  return found;
}

std::vector<CameraMode> V4l2Device::modes() const {
  std::vector<CameraMode> found;
  for (const uint32_t fourcc : formats()) list_sizes(fourcc, found);
  return found;
}

void V4l2Device::list_sizes(uint32_t fourcc, std::vector<CameraMode>& modes) const {
  for (uint32_t index = 0; index < kMaxEnumerated && modes.size() < kMaxEnumerated; ++index) {
    v4l2_frmsizeenum size{};
    size.index = index;
    size.pixel_format = fourcc;
    if (call(VIDIOC_ENUM_FRAMESIZES, &size) != 0) break;
    const bool is_discrete = size.type == V4L2_FRMSIZE_TYPE_DISCRETE;
    const int width = int(is_discrete ? size.discrete.width : size.stepwise.max_width);
    const int height = int(is_discrete ? size.discrete.height : size.stepwise.max_height);
    if (width >= 1 && height >= 1) {
      modes.push_back({fourcc_name(fourcc), known_v4l2_format(fourcc) != nullptr, width, height,
                       fastest_rate(fourcc, width, height).value_or(0)});
    }
    if (!is_discrete) break;  // every size up to that one
  }
}

std::optional<double> V4l2Device::fastest_rate(uint32_t fourcc, int width_px, int height_px) const {
  std::optional<double> best;
  for (uint32_t index = 0; index < kMaxEnumerated; ++index) {
    v4l2_frmivalenum interval{};
    interval.index = index;
    interval.pixel_format = fourcc;
    interval.width = uint32_t(width_px);
    interval.height = uint32_t(height_px);
    if (call(VIDIOC_ENUM_FRAMEINTERVALS, &interval) != 0) break;
    const bool is_discrete = interval.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const v4l2_fract& shortest = is_discrete ? interval.discrete : interval.stepwise.min;
    if (shortest.numerator > 0) best = std::max(best.value_or(0), double(shortest.denominator) / shortest.numerator);
    if (!is_discrete) break;
  }
  return best;
}

}  // namespace maq
