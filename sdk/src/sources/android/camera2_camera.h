// Cameras of Android, by the Camera2 functions of its NDK.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/log.h"
#include "sources/android/camera2_functions.h"
#include "sources/camera_backend.h"
#include "sources/uri.h"

namespace maq {

// Opens the camera `name` (an id of Android's, a number in its list, or "back", "front" or "external") at the size and
// rate nearest to `request` and starts it, with memory for `buffers` frames. Frames are upright on a display that is
// rotated by `display_deg` (a multiple of 90) from the device's natural orientation. They are NV12 in memory of the
// camera's own: they outlive Android's images, which go back at once. Throws MAQ_ERROR_NOT_FOUND,
// MAQ_ERROR_NO_PERMISSION, MAQ_ERROR_BUSY, MAQ_ERROR_DEVICE_LOST, MAQ_ERROR_OUT_OF_MEMORY, and MAQ_ERROR_UNSUPPORTED
// for a camera without images for processing. `functions` must outlive the camera.
std::shared_ptr<Camera> open_android_camera(const ndk::Functions& functions, const std::string& name,
                                            const CameraRequest& request, int display_deg, int buffers);

// Each camera with its sizes. A camera that does not report its modes is listed with the reason.
std::vector<CameraListing> list_android_cameras(const ndk::Functions& functions);

// For "android:0" or "android:back", with size, fps and display as requests. Throws for unknown options. Opened again,
// it is the camera of the same id. Opening throws MAQ_ERROR_RUNTIME_LIBRARY where there is no Android.
CameraOpener android_uri_opener(SourceUri uri, int buffers, const Log& log);

// The cameras of this device; empty where there is no Android.
std::vector<CameraListing> list_android_cameras();

}  // namespace maq
