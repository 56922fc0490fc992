// The exception of native code. jni_call.h turns it into a Java exception.
#pragma once

#include <string>

#include "maquette/maquette.h"

namespace maq_jni {

// A call of the C API that did not return MAQ_OK, or as good as that.
struct StatusError {
  maq_status status;
  std::string message;
};

inline void check(maq_status status) {
  if (status != MAQ_OK) throw StatusError{status, maq_last_error(nullptr)};
}

[[noreturn]] inline void refuse(const std::string& message) { throw StatusError{MAQ_ERROR_INVALID_ARGUMENT, message}; }

}  // namespace maq_jni
