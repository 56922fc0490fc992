// The interface of a camera backend: a device that streams into buffers of its own. LiveSource makes a source of it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/frame.h"
#include "maquette/source.h"

namespace maq {

// Asked of devices where the app asks for no size.
constexpr int kDefaultCameraWidthPx = 640, kDefaultCameraHeightPx = 480;

constexpr double kMillimetre = 0.001;  // the unit of DEPTH16

// The requested mode; 0 or empty: the device's default. The device's nearest mode is used.
struct CameraRequest {
  std::string format;  // four letters, as the device calls it: "MJPG"
  int width_px = 0;
  int height_px = 0;
  double fps = 0;
  double depth_unit_m = kMillimetre;  // for depth: metres of a stored 1, unknown to the device
};

struct CameraFormat {
  // Raw pixels, or JPEG images, which are decoded to BGR8 when the frame is taken.
  maq_pixel_format pixels = MAQ_PIXEL_YUYV;
  bool jpeg = false;
  int width_px = 0;
  int height_px = 0;
  double fps = 0;  // 0: the device does not say
};

// A filled buffer of the device, held until give_back().
struct CameraBuffer {
  ImageView image;                    // the pixels; for JPEG only the agreed size, or none
  double depth_unit_m = kMillimetre;  // unit of DEPTH16; with another unit, frames get metres as floats
  const uint8_t* jpeg = nullptr;      // the JPEG image
  size_t jpeg_bytes = 0;
  ImageView depth{MAQ_PIXEL_DEPTH16, 0, 0, {}};  // aligned with the image; width 0: none
  FrameOrigin origin;                            // origin in a replayed recording
  int slot = 0;
  int64_t timestamp_ns = 0;  // CLOCK_MONOTONIC, when the image was taken; no later than the one before: it is dropped
  uint32_t sequence = 0;     // counts the device's frames, including lost ones
  bool damaged = false;      // the device says that pixels are missing
  uint32_t seeks = 0;        // how often Camera::seek took effect before this frame
};

// A control and its set value.
struct ControlSetting {
  maq_source_control which;
  double value;
};

class Camera : public FrameOwner {
 public:
  enum class Event { kFrame, kTimeout, kWoken, kLost, kEnd };

  virtual const CameraFormat& format() const = 0;
  // Identifies the device in its socket, for any device number.
  virtual const std::string& identity() const = 0;
  // Null when the device does not know.
  virtual const maq_intrinsics* intrinsics() const { return nullptr; }
  // From any thread. Throw MAQ_ERROR_UNSUPPORTED for a control that the device does not have,
  // MAQ_ERROR_INVALID_ARGUMENT for values out of range, MAQ_ERROR_BUSY, MAQ_ERROR_DEVICE_LOST.
  virtual maq_source_control_info control(maq_source_control which);
  virtual void set_control(maq_source_control which, double value);
  // From any thread, of a replay: the next frame is the first at that time or later.
  virtual void seek(int64_t time_ns);
  // Waits until a buffer is filled, `timeout_ms` have passed, `wake_fd` is readable, the device is lost (`reason` says
  // how), or a replay has no more frames. Only one thread at a time.
  virtual Event wait(int wake_fd, int timeout_ms, CameraBuffer& buffer, std::string& reason) = 0;
  // Ends streaming and closes the device. Buffers that are held stay readable until the camera is destroyed.
  virtual void close() = 0;
};

// A connected camera and its modes.
struct CameraMode {
  std::string format;   // four letters: "YUYV"
  bool usable = false;  // whether this build understands the format
  int width_px = 0;
  int height_px = 0;
  double fps = 0;  // the fastest; 0: not known
};
struct CameraListing {
  std::string uri;             // "v4l2:/dev/video0"
  std::string name;            // as the device calls itself
  std::string bus;             // where it is plugged in
  std::string identity;        // as Camera::identity
  maq_status status = MAQ_OK;  // whether it can be opened
  std::string problem;         // why not
  std::vector<CameraMode> modes;
};

// Opens the camera and starts it. Throws.
using CameraOpener = std::function<std::shared_ptr<Camera>()>;

}  // namespace maq
