#include <fcntl.h>
#include <libcamera/libcamera.h>
#include <linux/dma-buf.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <deque>
#include <mutex>
#include <optional>
#include <tuple>

#include "core/error.h"
#include "core/module.h"
#include "sources/libcamera_cameras.h"

// Private in libcamera's header, but a symbol of its library: who makes a second manager in a process is aborted.
extern libcamera::CameraManager* running_manager __asm__("_ZN9libcamera13CameraManager5self_E") __attribute__((weak));

namespace maq {
namespace {

namespace formats = libcamera::formats;
namespace controls = libcamera::controls;

// What this build understands, the cheapest to use first. libcamera names formats of whole pixels from the highest byte
// of a little-endian number to the lowest: its RGB888 is B, G, R in memory.
struct KnownFormat {
  libcamera::PixelFormat format;
  maq_pixel_format pixels;
  bool jpeg;
};
constexpr KnownFormat kKnownFormats[] = {
    {formats::NV12, MAQ_PIXEL_NV12, false},      {formats::YUYV, MAQ_PIXEL_YUYV, false},
    {formats::RGB888, MAQ_PIXEL_BGR8, false},    {formats::BGR888, MAQ_PIXEL_RGB8, false},
    {formats::XBGR8888, MAQ_PIXEL_RGBA8, false}, {formats::ABGR8888, MAQ_PIXEL_RGBA8, false},
    {formats::R8, MAQ_PIXEL_GREY8, false},       {formats::MJPEG, MAQ_PIXEL_BGR8, true},
};
constexpr unsigned kDefaultWidthPx = 640;
constexpr unsigned kDefaultHeightPx = 480;
constexpr int kFencePatienceMs = 100;
constexpr int64_t kOldestFrameNs = 10000000000;

const KnownFormat* known_format(const libcamera::PixelFormat& format) {
  for (const KnownFormat& known : kKnownFormats) {
    if (known.format == format) return &known;
  }
  return nullptr;
}

// "MJPG", "RG24", "R8": the four letters of a format, without spaces at their end.
std::string four_letters(const libcamera::PixelFormat& format) {
  std::string letters;
  for (int shift = 0; shift < 32; shift += 8) letters += char(format.fourcc() >> shift);
  return letters.substr(0, letters.find_last_not_of(' ') + 1);
}

int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t(now.tv_sec) * 1000000000 + now.tv_nsec;
}

std::optional<double> number_of(const libcamera::ControlValue& value) {
  if (value.isArray()) return {};
  switch (value.type()) {
    case libcamera::ControlTypeBool: return value.get<bool>() ? 1 : 0;
    case libcamera::ControlTypeInteger32: return value.get<int32_t>();
    case libcamera::ControlTypeInteger64: return double(value.get<int64_t>());
    case libcamera::ControlTypeFloat: return value.get<float>();
    default: return {};
  }
}

// --- libcamera as a whole -----------------------------------------------------------------------------------------------

// A process may have one camera manager at a time. `mutex` is held while cameras are opened, closed and listed: a manager
// must be gone before the next starts, and a camera released before it is acquired again.
struct Library {
  std::timed_mutex mutex;
  std::unique_ptr<libcamera::CameraManager> manager;
  int users = 0;
};

// Never destroyed: threads that close cameras may outlive the program's static objects.
Library& library() {
  static Library* const one = new Library;
  return *one;
}

// The thread of a source that was destroyed last may still be closing its camera when the program ends. libcamera's own
// static objects, which are destroyed after this one, must not go away under it.
struct ExitGuard {
  ~ExitGuard() {
    if (library().mutex.try_lock_for(std::chrono::seconds(2))) return;  // and nobody gets it any more
  }
} exit_guard;

std::unique_lock<std::timed_mutex> lock_library() {
  std::unique_lock<std::timed_mutex> lock(library().mutex, std::chrono::seconds(5));
  if (!lock) {
    throw Error(MAQ_ERROR_BUSY, "libcamera has been opening or closing another camera for 5 s; does that one hang?");
  }
  return lock;
}

// Holds the manager. Made and destroyed while the library's mutex is held.
class ManagerUse {
 public:
  ManagerUse() {
    Library& shared = library();
    if (shared.users == 0) {
      if (&running_manager != nullptr && running_manager != nullptr) {
        throw Error(
            MAQ_ERROR_BUSY,
            "This program runs a CameraManager of its own, and libcamera allows one in a process: stop it first.");
      }
      if (std::getenv("LIBCAMERA_LOG_LEVELS") == nullptr && std::getenv("LIBCAMERA_LOG_FILE") == nullptr) {
        libcamera::logSetTarget(libcamera::LoggingTargetNone);
      }
      auto manager = std::make_unique<libcamera::CameraManager>();
      const int error = manager->start();
      if (error != 0) {
        throw Error(MAQ_ERROR_UNSUPPORTED, "libcamera does not start: ", std::strerror(std::abs(error)),
                    ". LIBCAMERA_LOG_LEVELS=*:DEBUG in the environment shows why.");
      }
      shared.manager = std::move(manager);
    }
    ++shared.users;
  }
  ~ManagerUse() {
    if (--library().users == 0) library().manager.reset();
  }
  ManagerUse(const ManagerUse&) = delete;
  ManagerUse& operator=(const ManagerUse&) = delete;

  libcamera::CameraManager* operator->() const { return library().manager.get(); }
};

// libcamera leaves out the devices that it may not open.
bool may_open_media_devices() {
  for (int number = 0; number < 64; ++number) {
    const std::string path = "/dev/media" + std::to_string(number);
    if (access(path.c_str(), R_OK | W_OK) != 0 && errno == EACCES) return false;
  }
  return true;
}

// The files under /sys that are there as long as the camera is. libcamera learns from udev that a camera is gone, and
// there is no udev in a container; its streams then just end.
std::vector<std::string> device_entries([[maybe_unused]] const ManagerUse& manager, const libcamera::Camera& camera) {
  std::vector<dev_t> numbers;
#if LIBCAMERA_VERSION_MAJOR == 0 && LIBCAMERA_VERSION_MINOR == 0
  for (int number = 0; number < 64; ++number) {
    struct stat found {};
    const std::string path = "/dev/video" + std::to_string(number);
    if (stat(path.c_str(), &found) == 0 && manager->get(found.st_rdev).get() == &camera) {
      numbers.push_back(found.st_rdev);
    }
  }
#else
  if (const auto found = camera.properties().get(libcamera::properties::SystemDevices)) {
    for (const int64_t number : *found) numbers.push_back(dev_t(number));
  }
#endif
  std::vector<std::string> entries;
  for (const dev_t number : numbers) {
    std::string entry = concatenate("/sys/dev/char/", major(number), ":", minor(number));
    if (access(entry.c_str(), F_OK) == 0) entries.push_back(std::move(entry));
  }
  return entries;
}

// --- from libcamera's thread to that of the source ----------------------------------------------------------------------

// What happened to a camera, in order.
class Mailbox {
 public:
  struct Item {
    int slot = -1;          // of a request that came back; -1: the camera is lost
    const char* lost = "";  // how
  };

  Mailbox() : fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC | EFD_SEMAPHORE)) {
    if (fd_ < 0)
      throw Error(MAQ_ERROR_OUT_OF_MEMORY, "No event can be made to wait for frames: ", std::strerror(errno));
  }
  ~Mailbox() { ::close(fd_); }
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;

  // Can be read as long as there is an item.
  int fd() const { return fd_; }

  void post(Item item) {
    std::lock_guard<std::mutex> lock(mutex_);
    items_.push_back(item);
    const uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(fd_, &one, sizeof one);
  }

  std::optional<Item> take() {
    std::lock_guard<std::mutex> lock(mutex_);
    uint64_t one = 0;
    if (::read(fd_, &one, sizeof one) != sizeof one || items_.empty()) return {};
    const Item item = items_.front();
    items_.erase(items_.begin());  // a handful
    return item;
  }

 private:
  int fd_;
  std::mutex mutex_;
  std::vector<Item> items_;
};

// Gets what libcamera tells of a camera. It lives in libcamera's thread, where signals are safe to connect and disconnect.
class Receiver : public libcamera::Object {
 public:
  Receiver(std::shared_ptr<libcamera::Camera> camera, Mailbox& mailbox)
      : camera_(std::move(camera)), mailbox_(mailbox) {
    moveToThread(camera_->thread());
    invokeMethod(&Receiver::attach, libcamera::ConnectionTypeBlocking);
  }

  // After this nothing more is put into the mailbox, and libcamera's thread has done all that it was asked for before.
  void retire() {
    invokeMethod(&Receiver::detach, libcamera::ConnectionTypeBlocking);
    deleteLater();
  }

 private:
  void attach() {
    camera_->requestCompleted.connect(this, &Receiver::completed);
    camera_->disconnected.connect(this, &Receiver::disconnected);
  }
  void detach() {
    camera_->requestCompleted.disconnect(this);
    camera_->disconnected.disconnect(this);
    camera_.reset();
  }
  void completed(libcamera::Request* request) { mailbox_.post({int(request->cookie()), ""}); }
  void disconnected() { mailbox_.post({-1, "the camera was unplugged"}); }

  std::shared_ptr<libcamera::Camera> camera_;
  Mailbox& mailbox_;
};

// --- controls -----------------------------------------------------------------------------------------------------------

// What a control is to libcamera, and the automatic that a value set by hand switches off.
struct KnownControl {
  maq_control which;
  const libcamera::ControlId& id;
  const libcamera::ControlId* automatic;
};
const KnownControl kKnownControls[] = {
    {MAQ_CONTROL_AUTO_EXPOSURE, controls::AeEnable, nullptr},
    {MAQ_CONTROL_EXPOSURE, controls::ExposureTime, &controls::AeEnable},
    {MAQ_CONTROL_GAIN, controls::AnalogueGain, nullptr},
    {MAQ_CONTROL_AUTO_FOCUS, controls::AfMode, nullptr},
    {MAQ_CONTROL_FOCUS, controls::LensPosition, &controls::AfMode},
    {MAQ_CONTROL_AUTO_WHITE_BALANCE, controls::AwbEnable, nullptr},
    {MAQ_CONTROL_WHITE_BALANCE, controls::ColourTemperature, &controls::AwbEnable},
    {MAQ_CONTROL_BRIGHTNESS, controls::Brightness, nullptr},
};

// Focus is the one automatic that is no switch but one of several ways: while frames come, or not at all.
double from_libcamera(const libcamera::ControlId& id, double value) {
  if (id.id() != controls::AfMode.id()) return value;
  return value == double(controls::AfModeContinuous) ? 1 : 0;
}

libcamera::ControlValue to_libcamera(const libcamera::ControlId& id, double value) {
  if (id.id() == controls::AfMode.id()) {
    return libcamera::ControlValue(int32_t(value != 0 ? controls::AfModeContinuous : controls::AfModeManual));
  }
  if (id.type() == libcamera::ControlTypeBool) return libcamera::ControlValue(value != 0);
  if (id.type() == libcamera::ControlTypeInteger32) return libcamera::ControlValue(int32_t(std::lround(value)));
  return libcamera::ControlValue(float(value));
}

// What the camera says of the control; nothing when it does not have it.
std::optional<maq_control_info> control_range(const libcamera::Camera& camera, const KnownControl& known) {
  const libcamera::ControlInfoMap& all = camera.controls();
  const auto found = all.find(known.id.id());
  if (found == all.end()) return {};
  const auto least = number_of(found->second.min()), most = number_of(found->second.max());
  if (!least || !most || !(*least <= *most)) return {};
  maq_control_info info{};
  info.least = *least;
  info.most = *most;
  info.step = known.id.type() == libcamera::ControlTypeFloat ? 0 : 1;
  info.preset = from_libcamera(known.id, number_of(found->second.def()).value_or(*least));
  if (known.id.id() == controls::AfMode.id()) {
    const auto& ways = found->second.values();
    const auto has = [&](int32_t way) {
      return std::any_of(ways.begin(), ways.end(), [&](const auto& value) { return number_of(value) == double(way); });
    };
    if (!has(controls::AfModeContinuous) || !has(controls::AfModeManual)) return {};
    info.least = 0;
    info.most = 1;
  }
  info.value = info.preset;
  return info;
}

// --- a camera -----------------------------------------------------------------------------------------------------------

class LibcameraCamera : public Camera {
 public:
  explicit LibcameraCamera(std::string name) : name_(std::move(name)) {}

  ~LibcameraCamera() override {
    close();
    for (const Slot& slot : slots_) {
      for (const Mapping& mapping : slot.mappings) munmap(mapping.data, mapping.size_bytes);
    }
  }

  // Both while the library's mutex is held. tear_down() also after a start() that threw.
  void start(const CameraWish& wish, int buffers);
  void tear_down();

  const CameraFormat& format() const override { return format_; }
  const std::string& identity() const override { return identity_; }
  maq_control_info control(maq_control which) override;
  void set_control(maq_control which, double value) override;
  Event wait(int wake_fd, int timeout_ms, CameraBuffer& buffer, std::string& reason) override;
  void give_back(int slot) override;
  int dma_buf(int slot) override { return slots_[size_t(slot)].dma_buf; }
  void close() override {
    if (is_closed_) return;  // who releases the last frame waits for nobody
    std::lock_guard<std::timed_mutex> lock(library().mutex);
    tear_down();
  }

 private:
  struct Mapping {
    libcamera::SharedFD fd;  // open as long as somebody may hold the frame, also when libcamera has let it go
    void* data;
    size_t size_bytes;
  };
  // A buffer, its request, and where its pixels are.
  struct Slot {
    std::unique_ptr<libcamera::Request> request;
    libcamera::FrameBuffer* buffer = nullptr;
    std::vector<Mapping> mappings;  // one for each file descriptor
    PlaneView planes[2];
    size_t size_bytes = 0;  // of a JPEG image at most, of pixels at least
    int dma_buf = -1;
  };
  struct ControlState {
    const KnownControl* known;
    maq_control_info info;
  };
  struct Setting {
    unsigned int id;
    libcamera::ControlValue value;
  };

  [[noreturn]] void fail(const std::string& what, int error) const;
  [[noreturn]] void refuse(const std::string& what) const;
  void find();
  void negotiate(const CameraWish& wish, int buffers);
  void adopt(const libcamera::StreamConfiguration& agreed);
  void make_slot(libcamera::FrameBuffer& buffer);
  const uint8_t* map(Slot& slot, const libcamera::FrameBuffer::Plane& plane);
  void set_rate(double fps, libcamera::ControlList& at_start);
  ControlState& control_state(maq_control which);
  void note_controls(const libcamera::ControlList& reported);
  int queue(Slot& slot);
  bool is_unplugged() const;
  static void synchronize(const Slot& slot, uint64_t flags);

  std::string name_, identity_;
  CameraFormat format_;
  size_t stride_bytes_ = 0;
  int cancelled_in_a_row_ = 0;
  std::vector<std::string> device_entries_;
  Mailbox mailbox_;
  std::vector<Slot> slots_;

  std::unique_ptr<ManagerUse> manager_;
  std::shared_ptr<libcamera::Camera> camera_;
  std::unique_ptr<libcamera::CameraConfiguration> configuration_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  Receiver* receiver_ = nullptr;  // deletes itself in libcamera's thread
  std::atomic<bool> is_closed_{false};
  bool started_ = false;
  bool lost_ = false;  // of the thread that waits, and closes

  std::mutex mutex_;  // of what follows, and of queueing
  bool streaming_ = false;
  std::vector<ControlState> controls_;
  std::deque<Setting> settings_;  // each goes out with a request of its own: the next may need it
};

void LibcameraCamera::fail(const std::string& what, int error) const {
  error = std::abs(error);
  maq_status status = MAQ_ERROR_UNSUPPORTED;
  const char* remedy = " LIBCAMERA_LOG_LEVELS=*:INFO in the environment shows what libcamera says to it.";
  switch (error) {
    case EBUSY:
      status = MAQ_ERROR_BUSY;
      remedy = " Another program, or another source of this one, uses the camera; close it.";
      break;
    case ENOSPC:
      status = MAQ_ERROR_BUSY;
      remedy = " The USB bus has no room left: ask for a smaller size, or plug the camera in elsewhere.";
      break;
    case EACCES:
    case EPERM:
      status = MAQ_ERROR_NO_PERMISSION;
      remedy =
          " Cameras belong to the group \"video\": add the user to it (sudo usermod -aG video $USER), log in again.";
      break;
    case ENOMEM:
    case EMFILE:
    case ENFILE:
      status = MAQ_ERROR_OUT_OF_MEMORY;
      remedy = " Ask for a smaller size or fewer frames, or close other files.";
      break;
    case ENODEV:
    case ENXIO:
    case EIO:
      status = MAQ_ERROR_DEVICE_LOST;
      remedy = " The camera is gone; plug it in again.";
      break;
  }
  throw Error(status, "libcamera:", name_, " ", what, ": ", std::strerror(error), ".", remedy);
}

void LibcameraCamera::refuse(const std::string& what) const {
  throw Error(MAQ_ERROR_UNSUPPORTED, "libcamera:", name_, " ", what, ".");
}

void LibcameraCamera::start(const CameraWish& wish, int buffers) {
  manager_ = std::make_unique<ManagerUse>();
  find();
  if (const int error = camera_->acquire(); error < 0) {
    camera_.reset();
    fail("cannot be acquired", error);
  }
  negotiate(wish, buffers);
  libcamera::Stream* const stream = configuration_->at(0).stream();
  allocator_ = std::make_unique<libcamera::FrameBufferAllocator>(camera_);
  if (const int error = allocator_->allocate(stream); error < 0) fail("gives no buffers", error);
  const auto& made = allocator_->buffers(stream);
  if (made.size() < 2 || made.size() > 256) {
    refuse(concatenate("gives ", made.size(), " buffers, of which at least 2 are needed"));
  }
  slots_.reserve(made.size());
  for (const auto& buffer : made) make_slot(*buffer);
  device_entries_ = device_entries(*manager_, *camera_);
  for (const KnownControl& known : kKnownControls) {
    if (const auto range = control_range(*camera_, known)) controls_.push_back({&known, *range});
  }
  libcamera::ControlList at_start(camera_->controls());
  set_rate(wish.fps, at_start);
  receiver_ = new Receiver(camera_, mailbox_);
  if (const int error = camera_->start(&at_start); error < 0) fail("does not start", error);
  started_ = true;
  for (size_t index = 0; index < slots_.size(); ++index) {
    Slot& slot = slots_[index];
    slot.request = camera_->createRequest(index);
    const int error = slot.request == nullptr ? -ENOMEM : slot.request->addBuffer(stream, slot.buffer);
    if (error < 0) fail("takes no buffers", error);
    if (const int queued = camera_->queueRequest(slot.request.get()); queued < 0) fail("takes no requests", queued);
  }
  streaming_ = true;
}

void LibcameraCamera::find() {
  const std::vector<std::shared_ptr<libcamera::Camera>> cameras = (*manager_)->cameras();
  const bool is_number = name_.find_first_not_of("0123456789") == std::string::npos;
  const size_t number = is_number && name_.size() < 9 ? size_t(std::stoul(name_)) : cameras.size();
  if (number < cameras.size()) {
    camera_ = cameras[number];
  } else if (!is_number) {
    camera_ = (*manager_)->get(name_);
  }
  if (camera_ == nullptr && !may_open_media_devices()) fail("is not there, or out of reach", EACCES);
  if (camera_ == nullptr) {
    throw Error(
        MAQ_ERROR_NOT_FOUND, "libcamera:", name_, " is not there: libcamera sees ",
        cameras.empty() ? "no camera" : concatenate(cameras.size(), cameras.size() == 1 ? " camera" : " cameras"),
        ". Is it plugged in, and is this its id? `maquette sources` lists them.");
  }
  identity_ = camera_->id();
}

// Of all formats that both sides know, the one nearest to the wished size, then the cheapest to use.
void LibcameraCamera::negotiate(const CameraWish& wish, int buffers) {
  configuration_ = camera_->generateConfiguration({libcamera::StreamRole::Viewfinder});
  if (configuration_ == nullptr || configuration_->empty()) refuse("offers no stream of pictures");
  libcamera::StreamConfiguration& stream = configuration_->at(0);
  const libcamera::StreamFormats offered = stream.formats();
  const libcamera::Size size(wish.width_px > 0 ? unsigned(wish.width_px) : kDefaultWidthPx,
                             wish.height_px > 0 ? unsigned(wish.height_px) : kDefaultHeightPx);
  const auto size_error = [&size](const libcamera::Size& other) {
    return std::abs(std::log(double(std::max(other.width, 1u)) / size.width)) +
           std::abs(std::log(double(std::max(other.height, 1u)) / size.height));
  };
  const auto propose = [&](const KnownFormat& known, const libcamera::Size& proposed) {
    stream.pixelFormat = known.format;
    stream.size = proposed;
    stream.stride = 0;
    stream.frameSize = 0;
    stream.bufferCount = unsigned(buffers);
    const bool is_yuv = known.pixels == MAQ_PIXEL_NV12 || known.pixels == MAQ_PIXEL_YUYV;
    stream.colorSpace.reset();
    if (is_yuv) stream.colorSpace = libcamera::ColorSpace::Smpte170m;
    return configuration_->validate() != libcamera::CameraConfiguration::Invalid && stream.pixelFormat == known.format;
  };
  struct Choice {
    double error;
    const KnownFormat* known;
    libcamera::Size size;
  };
  std::optional<Choice> best;
  std::string names;
  const std::vector<libcamera::PixelFormat> pixel_formats = offered.pixelformats();
  for (const libcamera::PixelFormat& format : pixel_formats)
    names += (names.empty() ? "" : ", ") + four_letters(format);
  for (const KnownFormat& known : kKnownFormats) {
    if (std::find(pixel_formats.begin(), pixel_formats.end(), known.format) == pixel_formats.end()) continue;
    if (!wish.format.empty() && wish.format != four_letters(known.format) && wish.format != known.format.toString()) {
      continue;
    }
    // What was wished for, and the nearest of the list: some cameras take any size, some the next smaller of the list.
    std::vector<libcamera::Size> proposals = offered.sizes(known.format);
    std::sort(proposals.begin(), proposals.end(),
              [&](const auto& a, const auto& b) { return size_error(a) < size_error(b); });
    proposals.resize(std::min<size_t>(proposals.size(), 1));
    proposals.push_back(size);
    for (const libcamera::Size& proposed : proposals) {
      if (!propose(known, proposed)) continue;
      if (!best || size_error(stream.size) < best->error) best = Choice{size_error(stream.size), &known, stream.size};
    }
  }
  if (!best) {
    refuse(concatenate("offers ", names.empty() ? "no format" : names, ", but ",
                       wish.format.empty() ? "none of them is understood" : "not " + wish.format));
  }
  if (!propose(*best->known, best->size)) refuse("does not take its own format");
  if (const int error = camera_->configure(configuration_.get()); error < 0)
    fail("does not take its own format", error);
  adopt(configuration_->at(0));
}

// The camera has the last word, and what it says is checked before it is believed.
void LibcameraCamera::adopt(const libcamera::StreamConfiguration& agreed) {
  const KnownFormat* known = known_format(agreed.pixelFormat);
  const uint64_t width = agreed.size.width, height = agreed.size.height;
  if (known == nullptr || agreed.stream() == nullptr || width < 1 || height < 1 || width > MAQ_MAX_SIDE_PX ||
      height > MAQ_MAX_SIDE_PX || width * height > MAQ_MAX_PIXELS) {
    refuse(concatenate("answered with a format that cannot be used (", width, " x ", height, ")"));
  }
  format_.pixels = known->pixels;
  format_.jpeg = known->jpeg;
  format_.width_px = int(width);
  format_.height_px = int(height);
  if (known->jpeg) return;
  const size_t row = row_bytes(known->pixels, 0, format_.width_px);
  stride_bytes_ = agreed.stride == 0 ? row : agreed.stride;
  if (stride_bytes_ < row || stride_bytes_ > 16 * row) {
    refuse(concatenate("answered with lines of ", stride_bytes_, " bytes for ", width, " pixels"));
  }
}

void LibcameraCamera::make_slot(libcamera::FrameBuffer& buffer) {
  slots_.emplace_back();
  Slot& slot = slots_.back();
  slot.buffer = &buffer;
  const auto& planes = buffer.planes();
  if (planes.empty()) refuse("has buffers without memory");
  if (format_.jpeg) {
    slot.planes[0].data = map(slot, planes[0]);
    slot.size_bytes = planes[0].length;
    return;
  }
  size_t before = 0;  // bytes of the planes before this one, where they share one
  for (int plane = 0; plane < plane_count(format_.pixels); ++plane) {
    const bool is_shared = plane > 0 && planes.size() == 1;
    const size_t rows = size_t(plane_rows(format_.pixels, plane, format_.height_px));
    const size_t needed = stride_bytes_ * (rows - 1) + row_bytes(format_.pixels, plane, format_.width_px);
    const size_t index = is_shared ? 0 : size_t(plane);
    const size_t length = index < planes.size() ? planes[index].length : 0;
    if (row_bytes(format_.pixels, plane, format_.width_px) > stride_bytes_ || length < before + needed) {
      refuse(concatenate("has ", length, " bytes in plane ", plane, " of its buffers for ", before + needed));
    }
    slot.planes[plane] = {map(slot, planes[index]) + before, stride_bytes_};
    slot.size_bytes += needed;
    if (planes.size() == 1) before += stride_bytes_ * rows;
  }
  if (slot.mappings.size() == 1 && planes[0].offset == 0) slot.dma_buf = slot.mappings[0].fd.get();
}

// Where the plane begins. Its memory is mapped unless that of a plane before it was in the same file.
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
  if (plane.offset == libcamera::FrameBuffer::Plane::kInvalidOffset ||
      size_t(plane.offset) + plane.length > mapping->size_bytes) {
    refuse(concatenate("has a plane at ", plane.offset, " with ", plane.length, " bytes in a buffer of ",
                       mapping->size_bytes));
  }
  return static_cast<const uint8_t*>(mapping->data) + plane.offset;
}

// As near to the wish as the camera can; a camera that has no such control keeps its rate to itself.
void LibcameraCamera::set_rate(double fps, libcamera::ControlList& at_start) {
  const libcamera::ControlInfoMap& all = camera_->controls();
  const auto found = all.find(controls::FrameDurationLimits.id());
  if (fps <= 0 || found == all.end()) return;
  const double least_us = number_of(found->second.min()).value_or(1);
  const double most_us = number_of(found->second.max()).value_or(1e9);
  if (!(least_us >= 1) || !(least_us <= most_us)) return;
  const int64_t duration_us = std::llround(std::clamp(1e6 / fps, least_us, most_us));
  const int64_t limits[2] = {duration_us, duration_us};
  at_start.set(controls::FrameDurationLimits.id(), libcamera::ControlValue(libcamera::Span<const int64_t, 2>(limits)));
  format_.fps = 1e6 / double(duration_us);
}

void LibcameraCamera::tear_down() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    streaming_ = false;
  }
  // Stopping brings every request back. With a device that is gone libcamera (0.0.3 to 0.7.2) fails to, and aborts the
  // program because of it; what it still holds then goes away with its camera.
  if (started_ && !lost_ && !is_unplugged()) camera_->stop();
  started_ = false;
  if (receiver_ != nullptr) receiver_->retire();
  receiver_ = nullptr;
  for (Slot& slot : slots_) slot.request.reset();
  allocator_.reset();
  if (camera_ != nullptr) camera_->release();
  camera_.reset();
  configuration_.reset();
  manager_.reset();
  is_closed_ = true;
}

bool LibcameraCamera::is_unplugged() const {
  return std::any_of(device_entries_.begin(), device_entries_.end(),
                     [](const std::string& entry) { return access(entry.c_str(), F_OK) != 0 && errno == ENOENT; });
}

// Tells the kernel that the processor is going to read the buffer (or has done so), because caches may hold what was in
// it before.
void LibcameraCamera::synchronize(const Slot& slot, uint64_t flags) {
  for (const Mapping& mapping : slot.mappings) {
    dma_buf_sync request{flags | DMA_BUF_SYNC_READ};
    while (ioctl(mapping.fd.get(), DMA_BUF_IOCTL_SYNC, &request) != 0 && (errno == EINTR || errno == EAGAIN)) {
    }
  }
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
  const std::optional<Mailbox::Item> item = mailbox_.take();
  if (!item) return is_unplugged() ? lost("the camera was unplugged") : Event::kTimeout;
  if (item->slot < 0) return lost(item->lost);

  Slot& slot = slots_[size_t(item->slot)];
  if (slot.request->status() == libcamera::Request::RequestCancelled) {
    // One is cancelled when its controls are refused; when all of them are, nothing will come any more.
    if (++cancelled_in_a_row_ > 2 * int(slots_.size())) return lost("libcamera cancels every request");
    give_back(item->slot);
    return Event::kTimeout;
  }
  cancelled_in_a_row_ = 0;
  synchronize(slot, DMA_BUF_SYNC_START);
  note_controls(slot.request->metadata());

  const libcamera::FrameMetadata& metadata = slot.buffer->metadata();
  const auto& planes = metadata.planes();
  size_t used_bytes = 0;
  for (const auto& plane : planes) used_bytes += plane.bytesused;
  // A fence that is left in the buffer is one that libcamera has not waited for to its end.
  const std::unique_ptr<libcamera::Fence> fence = slot.buffer->releaseFence();
  bool is_filled = metadata.status == libcamera::FrameMetadata::FrameSuccess;
  if (fence != nullptr && fence->isValid()) {
    pollfd signalled{fence->fd().get(), POLLIN, 0};
    is_filled = is_filled && ::poll(&signalled, 1, kFencePatienceMs) == 1 && (signalled.revents & POLLIN) != 0;
  }
  if (format_.jpeg) {
    buffer.jpeg = slot.planes[0].data;
    buffer.jpeg_bytes = std::min(used_bytes, slot.size_bytes);
  } else {
    buffer.image = {format_.pixels, format_.width_px, format_.height_px, {slot.planes[0], slot.planes[1]}};
  }
  buffer.slot = item->slot;
  buffer.sequence = metadata.sequence;
  buffer.damaged = !is_filled || (!format_.jpeg && used_bytes < slot.size_bytes);
  // Time of the clock that libcamera's pipelines use; not all are checked, and a wrong one would mislead.
  const int64_t now_ns = monotonic_ns();
  const auto taken_ns = int64_t(std::min<uint64_t>(metadata.timestamp, INT64_MAX));
  buffer.timestamp_ns = taken_ns > now_ns || taken_ns < now_ns - kOldestFrameNs ? now_ns : taken_ns;
  return Event::kFrame;
}

void LibcameraCamera::give_back(int index) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!streaming_) return;
  Slot& slot = slots_[size_t(index)];
  synchronize(slot, DMA_BUF_SYNC_END);
  slot.request->reuse(libcamera::Request::ReuseBuffers);
  if (!settings_.empty()) {
    slot.request->controls().set(settings_.front().id, settings_.front().value);
    settings_.pop_front();
  }
  if (camera_->queueRequest(slot.request.get()) < 0) mailbox_.post({-1, "libcamera takes no more requests"});
}

// The values that the camera says a frame was taken with.
void LibcameraCamera::note_controls(const libcamera::ControlList& reported) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!settings_.empty()) return;  // what was asked for last is still on its way
  for (ControlState& state : controls_) {
    if (!reported.contains(state.known->id.id())) continue;
    const auto value = number_of(reported.get(state.known->id.id()));
    if (value) state.info.value = from_libcamera(state.known->id, *value);
  }
}

LibcameraCamera::ControlState& LibcameraCamera::control_state(maq_control which) {
  if (!streaming_) throw Error(MAQ_ERROR_DEVICE_LOST, "libcamera:", name_, " is not open any more.");
  for (ControlState& state : controls_) {
    if (state.known->which == which) return state;
  }
  throw Error(MAQ_ERROR_UNSUPPORTED, "libcamera:", name_, " has no control ", int(which), " (maq_control).");
}

maq_control_info LibcameraCamera::control(maq_control which) {
  std::lock_guard<std::mutex> lock(mutex_);
  return control_state(which).info;
}

void LibcameraCamera::set_control(maq_control which, double value) {
  std::lock_guard<std::mutex> lock(mutex_);
  ControlState& state = control_state(which);
  const auto set = [this](ControlState& one, double to) {
    settings_.push_back({one.known->id.id(), to_libcamera(one.known->id, to)});
    one.info.value = to;
  };
  if (!(value >= state.info.least && value <= state.info.most)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Control ", int(which), " of libcamera:", name_, " goes from ",
                state.info.least, " to ", state.info.most, ", not to ", value, ".");
  }
  for (ControlState& other : controls_) {
    if (&other.known->id == state.known->automatic) set(other, 0);
  }
  set(state, state.info.step > 0 ? std::round(value) : value);
}

// --- what the library exports -------------------------------------------------------------------------------------------

// In a URI, '?' begins the options and '%' an escape.
std::string escaped(const std::string& id) {
  std::string text;
  for (const char c : id) {
    if (c == '?' || c == '%') {
      text += c == '?' ? "%3F" : "%25";
    } else {
      text += c;
    }
  }
  return text;
}

CameraListing describe(libcamera::Camera& camera) {
  CameraListing listing;
  listing.identity = camera.id();
  listing.uri = "libcamera:" + escaped(camera.id());
  const auto model = camera.properties().get(libcamera::properties::Model);
  listing.name = model ? std::string(*model) : camera.id();
  const auto configuration = camera.generateConfiguration({libcamera::StreamRole::Viewfinder});
  if (configuration == nullptr || configuration->empty()) return listing;
  const libcamera::StreamFormats& offered = configuration->at(0).formats();
  for (const libcamera::PixelFormat& format : offered.pixelformats()) {
    for (const libcamera::Size& size : offered.sizes(format)) {
      listing.modes.push_back(
          {four_letters(format), known_format(format) != nullptr, int(size.width), int(size.height), 0});
    }
  }
  return listing;
}

class Cameras : public LibcameraCameras {
 public:
  std::shared_ptr<Camera> open(const std::string& name, const CameraWish& wish, int buffers) const override {
    const auto camera = std::make_shared<LibcameraCamera>(name);  // destroyed when the mutex is free again
    const auto lock = lock_library();
    try {
      camera->start(wish, buffers);
    } catch (...) {
      camera->tear_down();
      throw;
    }
    return camera;
  }

  std::vector<CameraListing> list() const override {
    const auto lock = lock_library();
    const ManagerUse manager;
    std::vector<CameraListing> found;
    for (const auto& camera : manager->cameras()) found.push_back(describe(*camera));
    return found;
  }
};

}  // namespace
}  // namespace maq

extern "C" __attribute__((visibility("default"))) maq::ModuleExport maquette_libcamera() {
  static const maq::Cameras cameras;
  return {MAQ_MODULE_VERSION, static_cast<const maq::LibcameraCameras*>(&cameras)};
}
