// libcamera as a whole: a process may have one camera manager at a time. It runs as long as a camera uses it.
#pragma once

#include <libcamera/camera.h>
#include <libcamera/camera_manager.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace maq {

// Held while cameras are opened, closed and listed: a manager must be destroyed before the next starts, and a camera
// released before it is acquired again. Throws MAQ_ERROR_BUSY when another camera hangs in it.
std::unique_lock<std::timed_mutex> lock_libcamera();
// Waits for as long as it takes.
std::unique_lock<std::timed_mutex> lock_libcamera_to_close();

// Made and destroyed while that mutex is held.
class LibcameraManagerUse {
 public:
  // Starts the manager if it is the first. Throws MAQ_ERROR_BUSY when the app has a manager of its own.
  LibcameraManagerUse();
  ~LibcameraManagerUse();
  LibcameraManagerUse(const LibcameraManagerUse&) = delete;
  LibcameraManagerUse& operator=(const LibcameraManagerUse&) = delete;

  libcamera::CameraManager& operator*() const;
  libcamera::CameraManager* operator->() const { return &**this; }
};

// The camera of that id, or of that number in libcamera's list. Throws MAQ_ERROR_NOT_FOUND, MAQ_ERROR_NO_PERMISSION.
std::shared_ptr<libcamera::Camera> find_libcamera_camera(libcamera::CameraManager& manager, const std::string& name);

// The files under /sys that are there as long as the camera is. libcamera learns from udev that a camera is gone, and
// there is no udev in a container; frames then just stop to come.
std::vector<std::string> device_entries(libcamera::CameraManager& manager, const libcamera::Camera& camera);

}  // namespace maq
