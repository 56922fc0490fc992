// What a camera of libcamera cannot do, as the errors of this SDK.
#pragma once

#include <string>

namespace maq {

// Throws MAQ_ERROR_UNSUPPORTED; `name` is the camera's in its URI, `what` goes on after it.
[[noreturn]] void refuse_libcamera(const std::string& name, const std::string& what);

// Throws what the error number (negative as libcamera has it, or positive) means, and what to do.
[[noreturn]] void fail_libcamera(const std::string& name, const std::string& what, int error);

}  // namespace maq
