#include "sources/depthai/depthai_camera.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <mutex>

#include "core/clock.h"
#include "core/error.h"
#include "sources/camera_errors.h"
#include "sources/depthai/depthai_controls.h"
#include "sources/depthai/depthai_inbox.h"

namespace maq {
namespace {

constexpr double kDeviceFps = 30;
constexpr double kMinFps = 0.01;
constexpr int64_t kMaxLostInARow = 1000;

bool contains(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

// The vendor's library reports errors only as texts.
maq_status status_of(const std::string& text, maq_status fallback) {
  if (contains(text, "ermission")) return MAQ_ERROR_NO_PERMISSION;
  if (contains(text, "in use") || contains(text, "IN_USE")) return MAQ_ERROR_BUSY;
  if (contains(text, "No available devices") || contains(text, "Cannot find any device") ||
      contains(text, "Failed to find device")) {
    return MAQ_ERROR_NOT_FOUND;
  }
  if (contains(text, "X_LINK") || contains(text, "already closed")) return MAQ_ERROR_DEVICE_LOST;
  return fallback;
}

const char* remedy_for(maq_status status) {
  switch (status) {
    case MAQ_ERROR_NO_PERMISSION:
      return " The user needs a udev rule for the device: see docs/reference/cameras/depthai.md.";
    case MAQ_ERROR_NOT_FOUND: return " Is the device plugged in, powered, and free?";
    case MAQ_ERROR_DEVICE_LOST: return " The link to the device broke: check cable and power.";
    default: return camera_remedy(status);
  }
}

// Runs a call of the session. Its exceptions become an Error that names the device.
template <class Body>
auto guarded(const std::string& device, const char* what, maq_status fallback, Body&& body) {
  std::string text = "an exception of an unknown type";
  maq_status status = fallback;
  try {
    return body();
  } catch (const Error& error) {
    text = error.what();
    status = error.status();
  } catch (const std::exception& error) {
    text = error.what();
    status = status_of(text, fallback);
  } catch (...) {
  }
  throw Error(status, device, " ", what, ": ", text, text.empty() || text.back() != '.' ? "." : "", remedy_for(status));
}

ImageView view_of(const DepthAiFrame& frame) {
  ImageView view{*frame.format, int(frame.width_px), int(frame.height_px), {{frame.data, frame.stride_bytes}, {}}};
  if (plane_count(view.format) == 2) view.planes[1] = {frame.data + frame.uv_offset_bytes, frame.stride_bytes};
  return view;
}

class DepthAiCamera final : public Camera {
 public:
  // `handle`: name by which the device was opened.
  DepthAiCamera(const std::string& handle, std::unique_ptr<DepthAiSession> session, int buffers, const Log& log)
      : handle_(handle), log_(log), session_(std::move(session)), slots_(size_t(std::max(1, buffers))) {}
  ~DepthAiCamera() override { close(); }

  void start(const DepthAiRequest& request) {
    features_ = guarded(name_, "does not say what it is", MAQ_ERROR_UNSUPPORTED, [&] { return session_->features(); });
    if (features_.id.empty()) features_.id = handle_;
    const DepthAiPlan plan = agree(request);
    format_ = {MAQ_PIXEL_NV12, false, plan.width_px, plan.height_px, plan.fps};
    controls_ = DepthAiControls(features_, plan.fps);
    with_depth_ = plan.with_depth;
    const auto lens = guarded(name_, "does not give its calibration", MAQ_ERROR_UNSUPPORTED,
                              [&] { return session_->lens(plan.width_px, plan.height_px); });
    if (lens) intrinsics_ = depthai_intrinsics(*lens, plan);
    inbox_ = std::make_shared<DepthAiInbox>(plan);
    guarded(name_, "does not start", MAQ_ERROR_UNSUPPORTED, [&] { session_->start(plan, inbox_); });
  }

  const CameraFormat& format() const override { return format_; }
  const std::string& identity() const override { return features_.id; }
  const maq_intrinsics* intrinsics() const override { return intrinsics_ ? &*intrinsics_ : nullptr; }

  maq_source_control_info control(maq_source_control which) override {
    std::lock_guard<std::mutex> lock(mutex_);
    return controls_.info(which);
  }
  void set_control(maq_source_control which, double value) override {
    std::lock_guard<std::mutex> session_lock(session_mutex_);
    if (session_ == nullptr) throw Error(MAQ_ERROR_DEVICE_LOST, name_, " is closed.");
    DepthAiControls changed;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      changed = controls_;
    }
    guarded(name_, "does not take a control", MAQ_ERROR_DEVICE_LOST, [&] { changed.set(which, value, *session_); });
    std::lock_guard<std::mutex> lock(mutex_);
    controls_ = changed;
  }

  Event wait(int wake_fd, int timeout_ms, CameraBuffer& buffer, std::string& reason) override {
    const int64_t end_ns = monotonic_ns() + int64_t(timeout_ms) * 1000000;
    for (;;) {
      inbox_->event().take();
      const int64_t now_ns = monotonic_ns();
      int64_t due_ns = end_ns;
      // While all buffers are held, the oldest frames in the inbox make room for new ones.
      if (const std::optional<int> slot = free_slot()) {
        std::optional<DepthAiPair> pair = inbox_->next(now_ns);
        if (pair && fill(*slot, std::move(*pair), buffer)) return Event::kFrame;
        due_ns = pair ? now_ns : std::min(end_ns, inbox_->due_ns());
      }
      pollfd fds[2] = {{inbox_->event().get(), POLLIN, 0}, {wake_fd, POLLIN, 0}};
      const int64_t wait_ms = std::max<int64_t>(0, (due_ns - now_ns + 999999) / 1000000);
      if (::poll(fds, 2, int(wait_ms)) < 0 && errno != EINTR) {
        reason = concatenate("poll: ", std::strerror(errno));
        return Event::kLost;
      }
      if ((fds[1].revents & POLLIN) != 0) return Event::kWoken;
      if (monotonic_ns() < end_ns) continue;
      reason = link_problem();
      return reason.empty() ? Event::kTimeout : Event::kLost;
    }
  }

  void give_back(int slot) override {
    Slot emptied;  // freed after the lock is released
    {
      std::lock_guard<std::mutex> lock(mutex_);
      std::swap(emptied, slots_[size_t(slot)]);
    }
    inbox_->event().signal();
  }

  void close() override {
    std::lock_guard<std::mutex> lock(session_mutex_);
    if (session_ == nullptr) return;
    if (inbox_ != nullptr) inbox_->close();
    try {
      session_->close();
    } catch (...) {  // the session is destroyed anyway
    }
    session_.reset();
    if (with_depth_ && without_depth_ > 0) {
      log_.write(MAQ_LOG_INFO, name_, ": ", without_depth_, " of ", pictures_, " images came without depth");
    }
  }

 private:
  struct Slot {
    bool is_held = false;
    DepthAiFrame colour, depth;
  };

  // The nearest to the request that the device can do.
  DepthAiPlan agree(const DepthAiRequest& request) const {
    const bool has_size = request.width_px > 0 && request.height_px > 0;
    // In NV12 four pixels share a colour, and the link takes depth images of even size only.
    const auto side = [](int wanted, int max) { return std::max(2, (max > 0 ? std::min(wanted, max) : wanted) & ~1); };
    DepthAiPlan plan;
    plan.width_px = side(has_size ? request.width_px : kDefaultCameraWidthPx, features_.width_px);
    plan.height_px = side(has_size ? request.height_px : kDefaultCameraHeightPx, features_.height_px);
    plan.fps = request.fps > 0 ? request.fps : kDeviceFps;
    if (features_.fps >= kMinFps) plan.fps = std::min(plan.fps, features_.fps);
    plan.with_depth = request.depth.value_or(features_.has_stereo);
    if (plan.with_depth && !features_.has_stereo) {
      throw Error(MAQ_ERROR_UNSUPPORTED, name_, " has no pair of cameras to see depth with; open it with depth=0.");
    }
    return plan;
  }

  std::optional<int> free_slot() {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto found = std::find_if(slots_.begin(), slots_.end(), [](const Slot& slot) { return !slot.is_held; });
    if (found == slots_.end()) return {};
    return int(found - slots_.begin());
  }

  // False for a straggler, which the gap before it has counted already.
  bool fill(int slot, DepthAiPair pair, CameraBuffer& buffer) {
    const auto step = int64_t(uint64_t(pair.colour.sequence) - uint64_t(last_device_sequence_));
    if (pictures_ > 0 && step <= 0 && pair.colour.timestamp_ns <= last_timestamp_ns_) return false;
    // If a device restarts its count, or leaps, lost frames cannot be counted.
    sequence_ += pictures_ == 0 ? 0 : (step >= 1 && step <= kMaxLostInARow ? uint32_t(step) : 1);
    last_device_sequence_ = pair.colour.sequence;
    // The device's clock is fitted to ours again and again, and may step back.
    last_timestamp_ns_ = std::max(last_timestamp_ns_, pair.colour.timestamp_ns);
    ++pictures_;
    if (!pair.depth) ++without_depth_;

    buffer.image = view_of(pair.colour);
    if (pair.depth) buffer.depth = view_of(*pair.depth);
    buffer.slot = slot;
    buffer.timestamp_ns = last_timestamp_ns_;
    buffer.sequence = sequence_;
    std::lock_guard<std::mutex> lock(mutex_);
    controls_.note(pair.colour);
    Slot& held = slots_[size_t(slot)];
    held.is_held = true;
    held.colour = std::move(pair.colour);
    if (pair.depth) held.depth = std::move(*pair.depth);
    return true;
  }

  std::string link_problem() {
    try {
      return session_ == nullptr ? "it is closed" : session_->problem();
    } catch (const std::exception& error) {
      return error.what();
    } catch (...) {
      return "an exception of an unknown type";
    }
  }

  const std::string handle_;
  const std::string name_ = "DepthAI device " + handle_;
  const Log log_;
  std::mutex session_mutex_;  // guards session_ between wait() and threads that set controls
  std::unique_ptr<DepthAiSession> session_;
  std::shared_ptr<DepthAiInbox> inbox_;
  DepthAiFeatures features_;
  CameraFormat format_;
  std::optional<maq_intrinsics> intrinsics_;
  bool with_depth_ = false;

  std::mutex mutex_;  // guards slots_ and controls_
  std::vector<Slot> slots_;
  DepthAiControls controls_;

  // Used by the thread of wait() alone.
  int64_t last_device_sequence_ = 0, last_timestamp_ns_ = INT64_MIN;
  uint32_t sequence_ = 0;
  uint64_t pictures_ = 0, without_depth_ = 0;
};

std::vector<DepthAiDevice> devices_of(DepthAiDriver& driver) {
  return guarded("DepthAI", "cannot search for devices", MAQ_ERROR_NOT_FOUND, [&] { return driver.list(); });
}

const std::string& handle_of(const DepthAiDevice& device) { return device.id.empty() ? device.address : device.id; }

bool is_ip_address(const std::string& text) {
  return std::count(text.begin(), text.end(), '.') == 3 && text.find_first_not_of("0123456789.") == std::string::npos;
}

// Returns the name for opening a device: `identity`, or `device` before there is an identity.
std::string choose(DepthAiDriver& driver, const std::string& device, const std::string& identity) {
  const DepthAiDevice* refused = nullptr;
  std::string there;
  const std::vector<DepthAiDevice> found = devices_of(driver);
  for (const DepthAiDevice& one : found) {
    there += (there.empty() ? "" : ", ") + handle_of(one);
    const bool is_meant =
        identity.empty() ? device.empty() || device == one.id || device == one.address : identity == handle_of(one);
    if (!is_meant) continue;
    if (one.status == MAQ_OK) return handle_of(one);
    refused = &one;
  }
  if (refused != nullptr) {
    throw Error(refused->status, "DepthAI device ", handle_of(*refused), " cannot be opened: ", refused->problem, ".",
                remedy_for(refused->status));
  }
  // A device of another network does not answer when all are called, but when its address is.
  if (is_ip_address(device)) return device;
  throw Error(MAQ_ERROR_NOT_FOUND, "No DepthAI device ", device.empty() ? identity : device,
              device.empty() && identity.empty() ? "" : " ", "was found.", remedy_for(MAQ_ERROR_NOT_FOUND),
              there.empty() ? "" : " There are: " + there + ".");
}

std::shared_ptr<DepthAiCamera> open_chosen(DepthAiDriver& driver, const std::string& chosen,
                                           const DepthAiRequest& request, int buffers, const Log& log) {
  const std::string name = "DepthAI device " + chosen;
  std::unique_ptr<DepthAiSession> session =
      guarded(name, "cannot be opened", MAQ_ERROR_DEVICE_LOST, [&] { return driver.open(chosen); });
  if (session == nullptr) throw Error(MAQ_ERROR_DEVICE_LOST, name, " cannot be opened.");
  auto camera = std::make_shared<DepthAiCamera>(chosen, std::move(session), buffers, log);
  camera->start(request);
  return camera;
}

}  // namespace

std::optional<maq_intrinsics> depthai_intrinsics(const DepthAiLens& lens, const DepthAiPlan& plan) {
  constexpr size_t kKnown = 8;
  maq_intrinsics made{};
  made.width_px = plan.width_px;
  made.height_px = plan.height_px;
  made.fx_px = lens.fx_px;
  made.fy_px = lens.fy_px;
  made.cx_px = lens.cx_px;
  made.cy_px = lens.cy_px;
  const bool is_sane = std::isfinite(lens.fx_px) && std::isfinite(lens.fy_px) && std::isfinite(lens.cx_px) &&
                       std::isfinite(lens.cy_px) && lens.fx_px > 0 && lens.fy_px > 0;
  if (!is_sane) return {};
  if (plan.with_depth) return made;  // the device has taken the distortion out
  if (!lens.is_perspective) return {};
  for (size_t i = 0; i < lens.distortion.size(); ++i) {
    const double value = lens.distortion[i];
    if (!std::isfinite(value) || (i >= kKnown && value != 0)) return {};  // half a lens would be a wrong one
    if (i < kKnown) made.distortion[i] = value;
  }
  return made;
}

CameraOpener depthai_opener(DepthAiDriver& driver, const std::string& device, DepthAiRequest request, int buffers,
                            Log log) {
  return [&driver, device, request, buffers, log, identity = std::string()]() mutable {
    std::shared_ptr<DepthAiCamera> camera =
        open_chosen(driver, choose(driver, device, identity), request, buffers, log);
    if (!identity.empty() && camera->identity() != identity) {
      camera->close();
      throw Error(MAQ_ERROR_DEVICE_LOST, "At ", device, " is DepthAI device ", camera->identity(), " now, but it was ",
                  identity, ".");
    }
    identity = camera->identity();
    return camera;
  };
}

std::vector<CameraListing> list_depthai_cameras(DepthAiDriver& driver) {
  std::vector<CameraListing> listed;
  for (const DepthAiDevice& device : devices_of(driver)) {
    CameraListing listing;
    listing.uri = "depthai:" + handle_of(device);
    listing.bus = device.address;
    listing.identity = handle_of(device);
    listing.status = device.status;
    if (device.status == MAQ_OK) {
      listing.name = "DepthAI " + device.chip;
    } else {
      listing.problem = device.problem + "." + remedy_for(device.status);
    }
    listed.push_back(std::move(listing));
  }
  return listed;
}

}  // namespace maq
