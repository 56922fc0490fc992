#include "api/boundary.h"

#include <pthread.h>

#include <atomic>

namespace maq {
namespace {

std::atomic<uint32_t> forks{0};

// Of the thread, so that no call waits for another and no text is freed while it is read.
thread_local std::string latest_error;
thread_local std::string returned_error;

}  // namespace

const char kIsOfParent[] =
    "The object was made before fork(), by the parent process. Make a context and all that is made from it anew in "
    "the child.";

uint32_t fork_count() {
  // Numbers of processes do not tell: in a new namespace the child may have its parent's.
  static const bool is_registered = [] {
    if (pthread_atfork(nullptr, nullptr, [] { ++forks; }) != 0) throw std::bad_alloc();
    return true;
  }();
  return is_registered ? forks.load(std::memory_order_relaxed) : 0;
}

maq_status keep_error(const Handle* handle, maq_status status, const char* function, const char* text) noexcept {
  try {
    latest_error = function == nullptr ? text : concatenate(function, ": ", text);
    if (handle != nullptr) handle->set_error(latest_error);
  } catch (...) {
    // No memory for the text: the status still says what happened, as the text before it would not. So short a text
    // lies in the string itself.
    latest_error = kShortNoMemory;
    if (handle != nullptr) handle->set_error(kShortNoMemory);
  }
  return status;
}

const char* last_error(const Handle* handle) noexcept {
  try {
    returned_error = handle == nullptr || handle->is_of_parent() ? latest_error : handle->error();
    return returned_error.c_str();
  } catch (...) {
    return "There is not enough memory for the text of the error.";
  }
}

}  // namespace maq
