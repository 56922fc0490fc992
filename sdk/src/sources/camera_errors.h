// Maps a failed system call on a camera to a status and a remedy. One table for all backends.
#pragma once

#include <string>

#include "maquette/types.h"

namespace maq {

// Returns the status of an error number; MAQ_ERROR_UNSUPPORTED for all others.
maq_status camera_status(int error);

// A sentence with a leading space; "" where nothing is known to help.
const char* camera_remedy(maq_status status);

// Whether the device is gone, so that only opening it again can help.
bool is_device_lost(int error);

// Throws camera_status(error): "`name` `what`: the system's text.", then the remedy, or `hint` where there is none.
// Negative error numbers, as libcamera returns them, mean the same.
[[noreturn]] void fail_camera(const std::string& name, const std::string& what, int error, const char* hint = "");

// Throws MAQ_ERROR_UNSUPPORTED: "`name` `what`."
[[noreturn]] void refuse_camera(const std::string& name, const std::string& what);

}  // namespace maq
