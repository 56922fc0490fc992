#include "api/boundary.h"

#include <pthread.h>

#include <atomic>
#include <memory>

namespace maq {
namespace {

void free_texts(void* texts) { delete static_cast<ThreadTexts*>(texts); }

// Ends with the library: then threads may not call free_texts any more.
struct TextsKey {
  TextsKey() : is_there(pthread_key_create(&key, free_texts) == 0) {}
  ~TextsKey() {
    if (!is_there) return;
    free_texts(pthread_getspecific(key));
    pthread_key_delete(key);
  }
  pthread_key_t key = 0;
  bool is_there;
};

// Whether some thread without texts had an error, and no memory to keep it.
std::atomic<bool> has_lost_text{false};

}  // namespace

ThreadTexts* thread_texts() noexcept {
  static const TextsKey key;
  if (!key.is_there) return nullptr;
  if (void* const found = pthread_getspecific(key.key)) return static_cast<ThreadTexts*>(found);
  auto* const made = new (std::nothrow) ThreadTexts;
  if (made == nullptr || pthread_setspecific(key.key, made) == 0) return made;
  delete made;
  return nullptr;
}

const char kIsOfParent[] =
    "The object was made before fork(), by the parent process. Create it anew in the child, from a context of the "
    "child.";

maq_status keep_error(const Handle* handle, maq_status status, const char* function, const char* text) noexcept {
  ThreadTexts* const texts = thread_texts();
  const auto keep = [&](const std::string& said) {
    if (texts != nullptr) texts->latest_error = said;
    if (handle != nullptr && handle->handle_state().is_held()) handle->set_error(said);
  };
  if (texts == nullptr) has_lost_text = true;
  try {
    keep(function == nullptr ? text : concatenate(function, ": ", text));
  } catch (...) {
    // No memory for the text: the status still tells the error; an older text would not. So short a text lies in the
    // string itself.
    keep(kShortNoMemory);
  }
  return status;
}

const char* last_error(const Handle* handle) noexcept {
  ThreadTexts* const texts = thread_texts();
  if (texts == nullptr) return kNoMemory;
  try {
    std::string& returned = texts->returned_error;
    if (handle == nullptr || handle->handle_state().is_of_parent()) {
      returned = texts->latest_error;
      if (returned.empty() && has_lost_text) returned = kShortNoMemory;
    } else if (handle->handle_state().is_held()) {
      returned = handle->error();
    } else {
      returned = "maq_last_error: handle was given back before, or is not an object of this library.";
    }
    return returned.c_str();
  } catch (...) {
    return kNoMemory;
  }
}

}  // namespace maq
