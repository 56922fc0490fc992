#include "api/boundary.h"

namespace maq {
namespace {

// Of the thread, so that no call waits for another and no text is freed while it is read.
thread_local std::string latest_error;
thread_local std::string returned_error;

}  // namespace

maq_status keep_error(const Handle* handle, maq_status status, const char* function, const char* text) noexcept {
  try {
    latest_error = function == nullptr ? text : concatenate(function, ": ", text);
    if (handle != nullptr) handle->set_error(latest_error);
  } catch (...) {
    // No memory for the text: the status still says what happened.
  }
  return status;
}

const char* last_error(const Handle* handle) noexcept {
  try {
    returned_error = handle == nullptr ? latest_error : handle->error();
    return returned_error.c_str();
  } catch (...) {
    return "There is not enough memory for the text of the error.";
  }
}

}  // namespace maq
