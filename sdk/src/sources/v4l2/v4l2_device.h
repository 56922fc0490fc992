// An open Video4Linux2 device: its calls, its kind and its modes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sources/camera_backend.h"
#include "sources/v4l2/system_calls.h"

namespace maq {

// A pixel format that this build understands.
struct V4l2Format {
  uint32_t fourcc;
  maq_pixel_format pixels;
  bool jpeg;
  int memory_planes;  // 2: each plane of the image lies in memory of its own
};
// An element of one array, so that the cheaper of two is the lower pointer; null for a format that is not understood.
const V4l2Format* known_v4l2_format(uint32_t fourcc);

class V4l2Device {
 public:
  // Opens the device and checks that it is a camera that can stream. Throws the errors of open_v4l2_camera.
  V4l2Device(SystemCalls& calls, std::string path);
  ~V4l2Device();
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  int fd() const { return fd_; }
  const std::string& path() const { return path_; }
  const std::string& name() const { return name_; }
  const std::string& bus() const { return bus_; }
  const std::string& identity() const { return identity_; }
  bool is_planar() const { return is_planar_; }          // it speaks the multi-planar interface
  uint32_t buffer_type() const { return buffer_type_; }  // v4l2_buf_type

  // An ioctl, begun again when a signal interrupts it: -1 and errno when it fails. From any thread.
  int call(unsigned long request, void* argument) const;
  // Throws the error for the error number; `what` goes on after the path: "gives no buffers".
  [[noreturn]] void fail(const std::string& what, int error) const;

  // The fourcc of each format that it offers. Throws MAQ_ERROR_DEVICE_LOST.
  std::vector<uint32_t> formats() const;
  // The fastest rate at a size; nothing when the driver does not say.
  std::optional<double> fastest_rate(uint32_t fourcc, int width_px, int height_px) const;
  // Every format with its sizes. Throws MAQ_ERROR_DEVICE_LOST.
  std::vector<CameraMode> modes() const;

 private:
  void query_capabilities();
  void list_sizes(uint32_t fourcc, std::vector<CameraMode>& modes) const;

  SystemCalls& calls_;
  std::string path_, name_, bus_, identity_;
  int fd_ = -1;
  bool is_planar_ = false;
  uint32_t buffer_type_ = 0;
};

// "YUYV"
std::string fourcc_name(uint32_t fourcc);

}  // namespace maq
