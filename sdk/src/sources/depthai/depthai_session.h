// The interface to a DepthAI device (an OAK camera of Luxonis), in the SDK's own types. depthai_session.cpp does it
// with the vendor's library, in a library of its own, libmaquette_depthai.so; tests do it in memory.
//
// Everything a device says is a claim: DepthAiCamera checks it. Every call may throw a std::exception with a text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "maquette/frame.h"
#include "maquette/types.h"

namespace maq {

// A device that is plugged in or answers on the network.
struct DepthAiDevice {
  std::string id;       // its serial number; "" when it may not be asked
  std::string address;  // USB path or IP address
  std::string chip;     // "RVC2"
  maq_status status = MAQ_OK;
  std::string problem;  // why it cannot be opened now
};

struct DepthAiFeatures {
  std::string id;
  // Values of the colour camera; 0: not known.
  int width_px = 0;
  int height_px = 0;
  double fps = 0;  // the fastest
  bool has_autofocus = false;
  bool has_stereo = false;  // a pair of cameras that depth can be had from
};

struct DepthAiPlan {
  int width_px = 0;
  int height_px = 0;
  double fps = 0;
  // With depth the device takes the distortion of the lens out of the image: only then the two fit pixel by pixel.
  bool with_depth = false;
};

// Returns the calibration of the colour camera for images of a size.
struct DepthAiLens {
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  // In OpenCV's order: k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, taux, tauy.
  std::vector<double> distortion;
  bool is_perspective = true;  // false: the coefficients are of another model (fisheye)
};

// An image or a depth image as it came, without a copy.
struct DepthAiFrame {
  std::shared_ptr<const void> owner;  // owner of the bytes
  const uint8_t* data = nullptr;
  size_t size_bytes = 0;
  std::optional<maq_pixel_format> format;  // nothing: one that this SDK does not know
  int64_t width_px = 0;
  int64_t height_px = 0;
  size_t stride_bytes = 0;
  size_t uv_offset_bytes = 0;  // where the second plane of NV12 begins
  int64_t timestamp_ns = 0;    // CLOCK_MONOTONIC
  int64_t sequence = 0;
  // Settings of the camera for this image; 0: not known.
  int exposure_us = 0;
  int gain_iso = 0;
  int focus = 0;
  int white_balance_k = 0;
};

// Receives the frames, on threads of the session.
class DepthAiReceiver {
 public:
  virtual ~DepthAiReceiver() = default;
  virtual void receive_colour(DepthAiFrame frame) noexcept = 0;
  virtual void receive_depth(DepthAiFrame frame) noexcept = 0;
};

// A device that is open. One call at a time.
class DepthAiSession {
 public:
  virtual ~DepthAiSession() = default;  // closes the device
  virtual DepthAiFeatures features() = 0;
  // Nothing when the device was never calibrated.
  virtual std::optional<DepthAiLens> lens(int width_px, int height_px) = 0;
  virtual void start(const DepthAiPlan& plan, std::shared_ptr<DepthAiReceiver> receiver) = 0;
  // Why no frame can come any more; "" while the link is up.
  virtual std::string problem() = 0;
  // No frame is received after it.
  virtual void close() = 0;

  virtual void set_auto_exposure(bool on) = 0;  // off: exposure and gain stay as they are
  virtual void set_exposure(int exposure_us, int gain_iso) = 0;
  virtual void set_auto_focus(bool on) = 0;
  virtual void set_focus(int position) = 0;
  virtual void set_auto_white_balance(bool on) = 0;
  virtual void set_white_balance(int kelvin) = 0;
  virtual void set_brightness(int value) = 0;
};

class DepthAiDriver {
 public:
  virtual ~DepthAiDriver() = default;
  virtual std::vector<DepthAiDevice> list() = 0;
  // `device`: the id or the address. Blocks for seconds, while the device boots.
  virtual std::unique_ptr<DepthAiSession> open(const std::string& device) = 0;
};

// The export of the library, a DepthAiDriver (core/module.h).
constexpr char kDepthAiSymbol[] = "maquette_depthai";

}  // namespace maq
