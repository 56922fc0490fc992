// Maps a status of Android's camera functions to a status of the C API and a remedy.
#pragma once

#include <string>

#include "maquette/types.h"
#include "sources/android/camera2_functions.h"

namespace maq {

// MAQ_ERROR_UNSUPPORTED for statuses without their own meaning.
maq_status camera2_maq_status(ndk::camera_status_t status);

// Throws camera2_maq_status(status): "`name` `what`: the meaning of the status.", and the remedy.
[[noreturn]] void fail_camera2(const std::string& name, const std::string& what, ndk::camera_status_t status);

// Maps a status of the image functions.
[[noreturn]] void fail_camera2_images(const std::string& name, const std::string& what, ndk::media_status_t status);

// Returns the reason of a loss in the words of the callback onError.
const char* camera2_loss(int error);

constexpr char kCamera2Disconnected[] =
    "Android took the camera away: another app opened it, it was unplugged, or cameras were switched off";

}  // namespace maq
