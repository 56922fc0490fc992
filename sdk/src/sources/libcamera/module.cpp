// The export of libmaquette_libcamera.so.
#include <libcamera/property_ids.h>

#include "core/error.h"
#include "core/module.h"
#include "sources/libcamera/camera.h"
#include "sources/libcamera/formats.h"
#include "sources/libcamera/module_client.h"

namespace maq {
namespace {

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
  try {
    listing.modes = libcamera_modes(*libcamera_configuration(camera, "libcamera:" + camera.id()));
  } catch (const Error& error) {
    listing.status = error.status();
    listing.problem = error.what();
  }
  return listing;
}

class Cameras : public LibcameraCameras {
 public:
  std::shared_ptr<Camera> open(const std::string& name, const CameraRequest& request, int buffers) const override {
    const auto camera = std::make_shared<LibcameraCamera>(name);  // before the lock: destroyed after it
    const auto lock = lock_libcamera();
    try {
      camera->start(request, buffers);
    } catch (...) {
      camera->tear_down();
      throw;
    }
    return camera;
  }

  std::vector<CameraListing> list() const override {
    const auto lock = lock_libcamera();
    const LibcameraManagerUse manager;
    std::vector<CameraListing> found;
    for (const auto& camera : manager->cameras()) found.push_back(describe(*camera));
    return found;
  }
};

}  // namespace
}  // namespace maq

extern "C" __attribute__((visibility("default"))) maq::ModuleExport maquette_libcamera() {
  static maq::Cameras cameras;
  return {MAQ_MODULE_VERSION, static_cast<maq::LibcameraCameras*>(&cameras)};
}
