// Cameras of DepthAI (Luxonis OAK): colour with depth that fits it pixel by pixel, and calibration.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/log.h"
#include "sources/camera_backend.h"
#include "sources/depthai/depthai_session.h"

namespace maq {

// 0 and nothing: as the device has it. The nearest that the device offers is taken.
struct DepthAiWish {
  int width_px = 0;
  int height_px = 0;
  double fps = 0;
  std::optional<bool> depth;  // nothing: where the device has it
};

// Opens the device whose id or address (USB path, IP) `device` is, or the first that is free when it is empty, and after
// that the same device wherever it is plugged in; frames lie in `buffers` buffers at most. The opener throws
// MAQ_ERROR_NOT_FOUND, MAQ_ERROR_NO_PERMISSION, MAQ_ERROR_BUSY, MAQ_ERROR_DEVICE_LOST, and MAQ_ERROR_UNSUPPORTED for a
// device without what is wished. `driver` must outlive it and the cameras.
CameraOpener depthai_opener(DepthAiDriver& driver, const std::string& device, DepthAiWish wish, int buffers, Log log);

// The devices there are. They are not opened for it, so that what they offer is not told.
std::vector<CameraListing> list_depthai_cameras(DepthAiDriver& driver);

// Nothing when the lens cannot be said in maq_intrinsics, or its figures make no sense.
std::optional<maq_intrinsics> depthai_calibration(const DepthAiLens& lens, const DepthAiPlan& plan);

}  // namespace maq
