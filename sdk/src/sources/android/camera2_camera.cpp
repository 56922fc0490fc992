#include "sources/android/camera2_camera.h"

#include <poll.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <mutex>
#include <optional>
#include <utility>

#include "core/clock.h"
#include "core/error.h"
#include "image/yuv_planes.h"
#include "sources/android/camera2_characteristics.h"
#include "sources/android/camera2_errors.h"
#include "sources/android/camera2_mailbox.h"
#include "sources/control_options.h"

namespace maq {
namespace {

// One is read while the others arrive.
constexpr int kImages = 4;
// After this many unusable images in a row, no usable one will come.
constexpr int kMaxBadImages = 30;

int64_t boottime_ns() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return int64_t(now.tv_sec) * 1000000000 + now.tv_nsec;
}

// Objects of Android's; the function that ends one may return a status.
template <class Object, class Result>
using Owned = std::unique_ptr<Object, Result (*)(Object*)>;

// The objects for streaming, in the order of their creation; the end is in the other direction. Android's rules: the
// device is closed before the reader that it fills is deleted, and no image is out then.
struct Camera2Stream {
  explicit Camera2Stream(const ndk::Functions& functions)
      : manager(create_camera2_manager(functions)),
        reader(nullptr, functions.AImageReader_delete),
        output(nullptr, functions.ACaptureSessionOutput_free),
        outputs(nullptr, functions.ACaptureSessionOutputContainer_free),
        target(nullptr, functions.ACameraOutputTarget_free),
        device(nullptr, functions.ACameraDevice_close),
        request(nullptr, functions.ACaptureRequest_free),
        session(nullptr, functions.ACameraCaptureSession_close) {}

  Camera2Manager manager;
  Owned<ndk::AImageReader, void> reader;
  Owned<ndk::ACaptureSessionOutput, void> output;
  Owned<ndk::ACaptureSessionOutputContainer, void> outputs;
  Owned<ndk::ACameraOutputTarget, void> target;
  Owned<ndk::ACameraDevice, ndk::camera_status_t> device;
  Owned<ndk::ACaptureRequest, void> request;
  Owned<ndk::ACameraCaptureSession, void> session;
};

std::string id_of_camera(const ndk::Functions& functions, ndk::ACameraManager& manager, const std::string& name,
                         const std::string& label) {
  const std::vector<std::string> ids = camera2_ids(functions, manager);
  if (std::find(ids.begin(), ids.end(), name) != ids.end()) return name;
  const bool is_number = !name.empty() && name.size() <= 4 && name.find_first_not_of("0123456789") == std::string::npos;
  if (is_number && size_t(std::stoi(name)) < ids.size()) return ids[size_t(std::stoi(name))];
  std::string known;
  for (const std::string& id : ids) {
    std::string facing;
    try {
      facing = Camera2Characteristics(functions, manager, id, "android:" + id).facing();
    } catch (const Error&) {
      // Another camera may be the one.
    }
    if (!facing.empty() && facing == name) return id;
    known += (known.empty() ? "" : ", ") + id + (facing.empty() ? "" : " (" + facing + ")");
  }
  throw Error(MAQ_ERROR_NOT_FOUND, label, " is not a camera of this device; it has ", known.empty() ? "none" : known,
              ".");
}

class Camera2Camera final : public Camera {
 public:
  Camera2Camera(const ndk::Functions& functions, const std::string& name)
      : functions_(functions), name_(name), label_("android:" + name) {}

  ~Camera2Camera() override { close(); }

  void start(const CameraRequest& request, int display_deg, int buffers) {
    stream_.emplace(functions_);
    const std::string id = id_of_camera(functions_, *stream_->manager, name_, label_);
    identity_ = "android:" + id;
    const Camera2Characteristics found(functions_, *stream_->manager, id, label_);
    has_boottime_ = found.has_boottime();
    const Camera2Size size = found.nearest_size(request.width_px > 0 ? request.width_px : kDefaultCameraWidthPx,
                                                request.height_px > 0 ? request.height_px : kDefaultCameraHeightPx);
    quarter_turns_ = found.quarter_turns(display_deg);
    format_ = {MAQ_PIXEL_NV12, false, size.width_px, size.height_px, 0};
    if (quarter_turns_ % 2 == 1) std::swap(format_.width_px, format_.height_px);
    if (const auto intrinsics = found.intrinsics(size.width_px, size.height_px)) {
      intrinsics_ = rotated_intrinsics(*intrinsics, quarter_turns_);
    }
    slots_ = std::vector<Slot>(size_t(buffers));
    for (Slot& slot : slots_) slot.pixels.resize(packed_bytes(MAQ_PIXEL_NV12, size.width_px, size.height_px));

    ndk::ANativeWindow* const window = make_reader(size);
    ndk::ACameraDevice_StateCallbacks callbacks = mailbox_.device_callbacks();
    check(functions_.ACameraManager_openCamera(stream_->manager.get(), id.c_str(), &callbacks, out(stream_->device)),
          "cannot be opened");
    make_session(*window);
    set_rate(found, request.fps, size);
    ndk::ACaptureRequest* requests[] = {stream_->request.get()};
    ndk::ACameraCaptureSession_captureCallbacks captures = mailbox_.capture_callbacks();
    check(functions_.ACameraCaptureSession_setRepeatingRequest(stream_->session.get(), &captures, 1, requests, nullptr),
          "does not start");
  }

  const CameraFormat& format() const override { return format_; }
  const std::string& identity() const override { return identity_; }
  const maq_intrinsics* intrinsics() const override { return intrinsics_ ? &*intrinsics_ : nullptr; }

  Event wait(int wake_fd, int timeout_ms, CameraBuffer& buffer, std::string& reason) override {
    pollfd fds[2] = {{mailbox_.fd(), POLLIN, 0}, {wake_fd, POLLIN, 0}};
    const int ready = ::poll(fds, 2, timeout_ms);
    if (ready < 0 && errno != EINTR) {
      reason = concatenate("poll: ", std::strerror(errno));
      return Event::kLost;
    }
    if (ready > 0 && (fds[1].revents & POLLIN) != 0) return Event::kWoken;
    const char* how = "";
    switch (mailbox_.take(how)) {
      case Camera2Mailbox::Item::kNone: return Event::kTimeout;
      case Camera2Mailbox::Item::kLost: reason = how; return Event::kLost;
      case Camera2Mailbox::Item::kImage: break;
    }
    return take_image(buffer, reason);
  }

  void give_back(int slot) override { slots_[size_t(slot)].is_held.store(false, std::memory_order_release); }

  void close() override {
    std::lock_guard<std::mutex> lock(mutex_);
    stream_.reset();
  }

 private:
  using Image = Owned<ndk::AImage, void>;

  // Memory for one frame.
  struct Slot {
    std::vector<uint8_t> pixels;
    std::atomic<bool> is_held{false};  // until give_back()
  };

  // Takes ownership of an object that a function of Android made.
  template <class Object, class Result>
  class Out {
   public:
    explicit Out(Owned<Object, Result>& owner) : owner_(owner) {}
    ~Out() { owner_.reset(made_); }
    Out(const Out&) = delete;
    Out& operator=(const Out&) = delete;
    operator Object**() { return &made_; }  // NOLINT(google-explicit-constructor)

   private:
    Owned<Object, Result>& owner_;
    Object* made_ = nullptr;
  };
  template <class Object, class Result>
  static Out<Object, Result> out(Owned<Object, Result>& owner) {
    return Out<Object, Result>(owner);
  }

  void check(ndk::camera_status_t status, const char* what) const {
    if (status != ndk::ACAMERA_OK) fail_camera2(label_, what, status);
  }
  void check(ndk::media_status_t status, const char* what) const {
    if (status != ndk::AMEDIA_OK) fail_camera2_images(label_, what, status);
  }

  ndk::ANativeWindow* make_reader(const Camera2Size& size) {
    constexpr char kWhat[] = "gives no memory for its images";
    check(functions_.AImageReader_new(size.width_px, size.height_px, ndk::AIMAGE_FORMAT_YUV_420_888, kImages,
                                      out(stream_->reader)),
          kWhat);
    ndk::AImageReader_ImageListener listener = mailbox_.image_listener();
    check(functions_.AImageReader_setImageListener(stream_->reader.get(), &listener), kWhat);
    ndk::ANativeWindow* window = nullptr;  // the reader's
    check(functions_.AImageReader_getWindow(stream_->reader.get(), &window), kWhat);
    return window;
  }

  void make_session(ndk::ANativeWindow& window) {
    constexpr char kWhat[] = "does not take its own format";
    check(functions_.ACaptureSessionOutput_create(&window, out(stream_->output)), kWhat);
    check(functions_.ACaptureSessionOutputContainer_create(out(stream_->outputs)), kWhat);
    check(functions_.ACaptureSessionOutputContainer_add(stream_->outputs.get(), stream_->output.get()), kWhat);
    check(functions_.ACameraOutputTarget_create(&window, out(stream_->target)), kWhat);
    check(functions_.ACameraDevice_createCaptureRequest(stream_->device.get(), ndk::TEMPLATE_PREVIEW,
                                                        out(stream_->request)),
          kWhat);
    check(functions_.ACaptureRequest_addTarget(stream_->request.get(), stream_->target.get()), kWhat);
    const ndk::ACameraCaptureSession_stateCallbacks callbacks = Camera2Mailbox::session_callbacks();
    check(functions_.ACameraDevice_createCaptureSession(stream_->device.get(), stream_->outputs.get(), &callbacks,
                                                        out(stream_->session)),
          kWhat);
  }

  // A device without rates, or that does not take one, streams at its own.
  void set_rate(const Camera2Characteristics& found, double fps, const Camera2Size& size) {
    const std::optional<Camera2Rates> rates = fps > 0 ? found.nearest_rates(fps) : std::nullopt;
    if (rates) {
      const int32_t range[] = {rates->min, rates->max};
      functions_.ACaptureRequest_setEntry_i32(stream_->request.get(), ndk::ACAMERA_CONTROL_AE_TARGET_FPS_RANGE, 2,
                                              range);
    }
    ndk::ACameraMetadata_const_entry entry{};
    const auto status = functions_.ACaptureRequest_getConstEntry(stream_->request.get(),
                                                                 ndk::ACAMERA_CONTROL_AE_TARGET_FPS_RANGE, &entry);
    if (status != ndk::ACAMERA_OK || entry.type != ndk::ACAMERA_TYPE_INT32 || entry.count != 2) return;
    const double fps_now = Camera2Rates{entry.data.i32[0], entry.data.i32[1]}.max_fps();
    if (fps_now > 0) format_.fps = size.fps > 0 ? std::min(size.fps, fps_now) : fps_now;
  }

  // The next image as a frame, if it is one.
  Event take_image(CameraBuffer& buffer, std::string& reason) {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!stream_) {
      reason = "the camera is closed";
      return Event::kLost;
    }
    ndk::AImage* acquired = nullptr;
    const auto status = functions_.AImageReader_acquireNextImage(stream_->reader.get(), &acquired);
    if (status == ndk::AMEDIA_IMGREADER_NO_BUFFER_AVAILABLE) return Event::kTimeout;
    // Android's image goes back when this returns, whatever the app holds: it has few, and a reader with an image out
    // cannot be deleted.
    const Image image(acquired, functions_.AImage_delete);
    sequence_ += 1 + mailbox_.take_lost_frames();
    std::optional<std::string> problem;
    if (status != ndk::AMEDIA_OK || image == nullptr) {
      problem = concatenate("AImageReader_acquireNextImage: media_status_t ", int(status));
    } else {
      const auto free = std::find_if(slots_.begin(), slots_.end(),
                                     [](const Slot& slot) { return !slot.is_held.load(std::memory_order_acquire); });
      if (free == slots_.end()) return Event::kTimeout;  // it is lost, which the next number tells
      problem = read_image(*image, *free, buffer);
      buffer.slot = int(free - slots_.begin());
    }
    if (!problem) {
      bad_images_ = 0;
      return Event::kFrame;
    }
    if (++bad_images_ < kMaxBadImages) return Event::kTimeout;
    reason = *problem;
    return Event::kLost;
  }

  // Returns the problem of the image, or nothing: then `slot` is held and `buffer` shows the image.
  std::optional<std::string> read_image(const ndk::AImage& image, Slot& slot, CameraBuffer& buffer) {
    YuvImage found;
    int64_t stamp_ns = 0;
    ndk::media_status_t status = functions_.AImage_getWidth(&image, &found.width_px);
    const auto then = [&](auto read) {
      if (status == ndk::AMEDIA_OK) status = read();
    };
    then([&] { return functions_.AImage_getHeight(&image, &found.height_px); });
    then([&] { return functions_.AImage_getTimestamp(&image, &stamp_ns); });
    for (int index = 0; index < 3; ++index) {
      YuvPlane& plane = found.planes[index];
      uint8_t* data = nullptr;
      int bytes = 0;
      then([&] { return functions_.AImage_getPlaneData(&image, index, &data, &bytes); });
      then([&] { return functions_.AImage_getPlaneRowStride(&image, index, &plane.row_stride); });
      then([&] { return functions_.AImage_getPlanePixelStride(&image, index, &plane.pixel_stride); });
      plane.data = data;
      plane.bytes = size_t(std::max(bytes, 0));
    }
    if (status != ndk::AMEDIA_OK) return concatenate("its images cannot be read: media_status_t ", int(status));
    if (auto problem = yuv_image_problem(found)) return problem;
    // Other than agreed, if the device says so of its image.
    int width = found.width_px, height = found.height_px;
    if (quarter_turns_ % 2 == 1) std::swap(width, height);
    slot.pixels.resize(packed_bytes(MAQ_PIXEL_NV12, width, height));
    yuv_to_nv12(found, quarter_turns_, slot.pixels.data());
    buffer.image = packed_view(MAQ_PIXEL_NV12, width, height, slot.pixels.data());
    const auto boottime_now = has_boottime_ ? std::optional<int64_t>(boottime_ns()) : std::nullopt;
    buffer.timestamp_ns = camera2_time_ns(stamp_ns, boottime_now, monotonic_ns());
    buffer.sequence = sequence_;
    slot.is_held.store(true, std::memory_order_relaxed);
    return {};
  }

  const ndk::Functions& functions_;
  std::string name_, label_, identity_;
  CameraFormat format_;    // format of the rotated images
  int quarter_turns_ = 0;  // clockwise
  std::optional<maq_intrinsics> intrinsics_;
  bool has_boottime_ = false;
  std::vector<Slot> slots_;
  uint32_t sequence_ = 0;
  int bad_images_ = 0;
  Camera2Mailbox mailbox_;
  std::mutex mutex_;  // guards stream_ while an image of it is out
  std::optional<Camera2Stream> stream_;
};

const ndk::Functions& android() {
  static const ndk::Functions functions = ndk::load_functions();  // tried again when it throws
  return functions;
}

}  // namespace

std::shared_ptr<Camera> open_android_camera(const ndk::Functions& functions, const std::string& name,
                                            const CameraRequest& request, int display_deg, int buffers) {
  auto camera = std::make_shared<Camera2Camera>(functions, name);
  camera->start(request, display_deg, buffers);
  return camera;
}

std::vector<CameraListing> list_android_cameras(const ndk::Functions& functions) {
  const Camera2Manager manager = create_camera2_manager(functions);
  std::vector<CameraListing> found;
  for (const std::string& id : camera2_ids(functions, *manager)) {
    CameraListing listing;
    listing.uri = listing.identity = "android:" + id;
    listing.bus = "camera2";
    try {
      const Camera2Characteristics camera(functions, *manager, id, listing.uri);
      listing.name = std::string(camera.facing()) + (*camera.facing() == '\0' ? "camera" : " camera");
      for (const Camera2Size& size : camera.sizes()) {
        listing.modes.push_back({"NV12", true, size.width_px, size.height_px, size.fps});
      }
    } catch (const Error& error) {
      listing.status = error.status();
      listing.problem = error.what();
    }
    found.push_back(std::move(listing));
  }
  return found;
}

CameraOpener android_uri_opener(SourceUri uri, int buffers, const Log&) {
  const CameraRequest request{"", uri.width_px, uri.height_px, uri.fps};
  const int display_deg = int(uri.take_integer("display", 0, 0, 270));
  if (display_deg % 90 != 0) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "display=", display_deg, " in ", uri.text,
                " is invalid; use 0, 90, 180 or 270.");
  }
  uri.expect_no_more_options("size, fps and display");
  return [name = uri.target, request, display_deg, buffers]() mutable {
    std::shared_ptr<Camera> camera = open_android_camera(android(), name, request, display_deg, buffers);
    name = camera->identity().substr(camera->identity().find(':') + 1);
    return camera;
  };
}

std::vector<CameraListing> list_android_cameras() {
  try {
    return list_android_cameras(android());
  } catch (const std::exception&) {
    return {};
  }
}

}  // namespace maq
