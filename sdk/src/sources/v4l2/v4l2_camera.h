// Cameras of Linux' own interface, Video4Linux2, without any library: memory-mapped streaming.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/log.h"
#include "sources/camera_backend.h"
#include "sources/uri.h"
#include "sources/v4l2/system_calls.h"

namespace maq {

// Opens `path` ("/dev/video0"), agrees on the format nearest to `request` and starts streaming into `buffers` buffers.
// Throws MAQ_ERROR_NOT_FOUND, MAQ_ERROR_NO_PERMISSION, MAQ_ERROR_BUSY, MAQ_ERROR_DEVICE_LOST, and MAQ_ERROR_UNSUPPORTED
// for a device that is not a camera or offers no format that this build knows. `calls` must outlive the camera.
std::shared_ptr<Camera> open_v4l2_camera(SystemCalls& calls, const std::string& path, const CameraRequest& request,
                                         int buffers);

// Opens the camera at `path`, and after that the same device wherever it is: one that was plugged in again gets another
// number while frames of before are held.
CameraOpener v4l2_opener(SystemCalls& calls, const std::string& path, CameraRequest request, int buffers);

// For "v4l2:/dev/video0" or "v4l2:0", with size, fps and format as requests. Throws for unknown options.
CameraOpener v4l2_uri_opener(SourceUri uri, int buffers, const Log& log);

// The cameras among /dev/video0 to /dev/video63. One that cannot be opened is listed with the reason.
std::vector<CameraListing> list_v4l2_cameras(SystemCalls& calls);

}  // namespace maq
