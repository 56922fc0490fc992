#include "api/boundary.h"

namespace maq {
namespace {

// One text for each thread, so that no call waits for another and no text is freed while it is read.
thread_local std::string latest_error;
thread_local std::string returned_error;

}  // namespace

const char kIsOfParent[] =
    "The object was made before fork(), by the parent process. Create it anew in the child, from a context of the "
    "child.";

maq_status keep_error(const Handle* handle, maq_status status, const char* function, const char* text) noexcept {
  try {
    latest_error = function == nullptr ? text : concatenate(function, ": ", text);
    if (handle != nullptr && handle->handle_state().is_held()) handle->set_error(latest_error);
  } catch (...) {
    // No memory for the text: the status still tells the error; an older text would not. So short a text lies in the
    // string itself.
    latest_error = kShortNoMemory;
    if (handle != nullptr && handle->handle_state().is_held()) handle->set_error(kShortNoMemory);
  }
  return status;
}

const char* last_error(const Handle* handle) noexcept {
  try {
    if (handle == nullptr || handle->handle_state().is_of_parent()) {
      returned_error = latest_error;
    } else if (handle->handle_state().is_held()) {
      returned_error = handle->error();
    } else {
      returned_error = "maq_last_error: handle was given back before, or is not an object of this library.";
    }
    return returned_error.c_str();
  } catch (...) {
    return "There is not enough memory for the text of the error.";
  }
}

}  // namespace maq
