// Cameras of DepthAI (Luxonis OAK): colour with depth that fits it pixel by pixel, and intrinsics.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/log.h"
#include "sources/camera_backend.h"
#include "sources/depthai/depthai_session.h"

namespace maq {

// 0 and nothing: the device's default. The nearest that the device offers is taken.
struct DepthAiRequest {
  int width_px = 0;
  int height_px = 0;
  double fps = 0;
  std::optional<bool> depth;  // nothing: where the device has it
};

// Opens the device whose id or address (USB path, IP) `device` is, or the first that is free when it is empty, and
// after that the same device wherever it is plugged in; frames lie in `buffers` buffers at most. The opener throws
// MAQ_ERROR_NOT_FOUND, MAQ_ERROR_NO_PERMISSION, MAQ_ERROR_BUSY, MAQ_ERROR_DEVICE_LOST, and MAQ_ERROR_UNSUPPORTED for a
// device that lacks what is requested. `driver` must outlive it and the cameras.
CameraOpener depthai_opener(DepthAiDriver& driver, const std::string& device, DepthAiRequest request, int buffers,
                            Log log);

// The connected devices. They are not opened for it, so that their modes are not known.
std::vector<CameraListing> list_depthai_cameras(DepthAiDriver& driver);

// Nothing when maq_intrinsics cannot express the lens, or its values make no sense.
std::optional<maq_intrinsics> depthai_intrinsics(const DepthAiLens& lens, const DepthAiPlan& plan);

}  // namespace maq
