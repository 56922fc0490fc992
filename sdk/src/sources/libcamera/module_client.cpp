#include "sources/libcamera/module_client.h"

#include "core/memory.h"
#include "core/module.h"
#include "core/thread.h"
#include "sources/control_options.h"

namespace maq {
namespace {

const void* load() {
  // libcamera brings LTTng, which starts two threads as it is loaded and, where they did not start, crashes as the
  // program ends.
  require_memory(size_t(64) << 20);
  require_threads(2);
  return open_module("libmaquette_libcamera.so", kLibcameraSymbol, "Cameras of libcamera need",
                     "Install libcamera, and an SDK that was built where its headers are (libcamera-dev on Debian).");
}

const LibcameraCameras& cameras() {
  static const auto* const opened = static_cast<const LibcameraCameras*>(load());  // tried again when it throws
  return *opened;
}

}  // namespace

CameraOpener libcamera_uri_opener(SourceUri uri, int buffers, const Log&) {
  CameraRequest request{uri.take_text("format"), uri.width_px, uri.height_px, uri.fps};
  uri.expect_no_more_options(std::string("size, fps, format, ") + kControlOptions);
  return [name = uri.target, request = std::move(request), buffers]() mutable {
    std::shared_ptr<Camera> camera = cameras().open(name, request, buffers);
    name = camera->identity();
    return camera;
  };
}

std::vector<CameraListing> list_libcamera_cameras() {
  try {
    return cameras().list();
  } catch (const std::exception&) {
    return {};
  }
}

}  // namespace maq
