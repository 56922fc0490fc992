// What a camera backend is: a device that streams into buffers of its own. LiveSource makes a source of it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/frame.h"

namespace maq {

// What the app asks for; 0 or empty: as the device has it. The nearest that the device offers is taken.
struct CameraWish {
  std::string format;  // four letters, as the device calls it: "MJPG"
  int width_px = 0;
  int height_px = 0;
  double fps = 0;
};

struct CameraFormat {
  // Pixels as they come, or JPEG images, which are decoded to BGR8 when somebody takes the frame.
  maq_pixel_format pixels = MAQ_PIXEL_YUYV;
  bool jpeg = false;
  int width_px = 0;
  int height_px = 0;
  size_t stride_bytes = 0;  // of the first plane; that of a second plane is the same
  double fps = 0;           // 0: the device does not say
};

// A filled buffer of the device. It belongs to whoever got it until it is given back.
struct CameraBuffer {
  const uint8_t* data = nullptr;
  size_t size_bytes = 0;
  int slot = 0;
  int64_t timestamp_ns = 0;  // CLOCK_MONOTONIC, when the picture was taken
  uint32_t sequence = 0;     // counts the device's frames, those that were lost included
  bool damaged = false;      // the device says that pixels are missing
};

class Camera : public FrameOwner {
 public:
  enum class Event { kFrame, kTimeout, kWoken, kLost };

  virtual const CameraFormat& format() const = 0;
  // The same for the same device in the same socket, whatever number it gets.
  virtual const std::string& identity() const = 0;
  // Waits until a buffer is filled, `timeout_ms` are over, `wake_fd` can be read, or the device is gone (`reason` says
  // how). Only one thread at a time.
  virtual Event wait(int wake_fd, int timeout_ms, CameraBuffer& buffer, std::string& reason) = 0;
  // Ends streaming and closes the device. Buffers that are held stay readable until the camera is destroyed.
  virtual void close() = 0;
};

// A camera that is there, and what it offers.
struct CameraMode {
  std::string format;   // four letters: "YUYV"
  bool usable = false;  // whether this build understands the format
  int width_px = 0;
  int height_px = 0;
  double fps = 0;  // the fastest; 0: not told
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
