// Cameras of libcamera. The code that includes its headers is a module, libmaquette_libcamera.so (core/module.h):
// libcamera brings some twenty shared libraries, which most machines do without.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/log.h"
#include "sources/camera_backend.h"
#include "sources/uri.h"

namespace maq {

// The export of the module.
class LibcameraCameras {
 public:
  virtual ~LibcameraCameras() = default;
  // Opens the camera `name`, an id of libcamera or a number in its list, and starts it. Throws the errors of
  // libcamera_uri_opener.
  virtual std::shared_ptr<Camera> open(const std::string& name, const CameraRequest& request, int buffers) const = 0;
  virtual std::vector<CameraListing> list() const = 0;
};
constexpr char kLibcameraSymbol[] = "maquette_libcamera";

// For "libcamera:0" or "libcamera:<id>", with size, fps and format as requests. Throws for unknown options.
// Opening throws MAQ_ERROR_RUNTIME_LIBRARY without libmaquette_libcamera.so, and MAQ_ERROR_NOT_FOUND, _NO_PERMISSION,
// _BUSY, _DEVICE_LOST, _OUT_OF_MEMORY, and _UNSUPPORTED for a camera without a format that this build knows. Opened
// again, it is the camera of the same id, whatever number it has then.
CameraOpener libcamera_uri_opener(SourceUri uri, int buffers, const Log& log);

// The cameras that are connected; empty without the module.
std::vector<CameraListing> list_libcamera_cameras();

}  // namespace maq
