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

ArgumentError::ArgumentError(std::initializer_list<TextPart> parts) : Error(MAQ_ERROR_INVALID_ARGUMENT, parts) {}

maq_status run_guarded(const Handle* handle, const char* function, const Call& body) noexcept {
  try {
    if (handle != nullptr && handle->handle_state().is_of_parent()) {
      return keep_error(nullptr, MAQ_ERROR_INVALID_ARGUMENT, function, kIsOfParent);
    }
    return body();
  } catch (const ArgumentError& error) {
    return keep_error(handle, error.status(), function, error.what());
  } catch (const Error& error) {
    return keep_error(handle, error.status(), nullptr, error.what());
  } catch (...) {
    const Failure failure = current_failure();
    return keep_error(handle, failure.status, failure.status == MAQ_ERROR_INTERNAL ? function : nullptr, failure.text);
  }
}

maq_status run_alone(const Handle* handle, HandleKind kind, const char* name, const char* function,
                     const Call& body) noexcept {
  // Until the error has been kept with the handle too.
  struct Use {
    HandleState* state;
    ~Use() {
      if (state != nullptr) state->end_call();
    }
  };
  const Use use{handle != nullptr && handle->handle_state().begin_call(kind) ? &handle->handle_state() : nullptr};
  return guarded(handle, function, [&] {
    if (handle == nullptr) refuse_null(name);
    require_handle(*handle, kind, name);
    if (use.state == nullptr) {
      throw ArgumentError(name, " is in use by another call; let that return first, or make one for each thread.");
    }
    return body();
  });
}

void reclaim_handle(Handle* handle, HandleKind kind, const char* name, const char* function, const Call& reclaim,
                    WhileInUse while_in_use) noexcept {
  if (handle == nullptr) return;
  guarded(nullptr, function, [&] {
    HandleState& state = handle->handle_state();
    if (state.is_of_parent()) return MAQ_OK;
    bool is_in_use = false;
    if (state.mark_returned(kind, while_in_use == WhileInUse::kAllowed, is_in_use)) return reclaim();
    if (is_in_use) throw ArgumentError(name, " is in use by another call, so it was not freed; let that return first.");
    state.refuse(kind, name);
  });
}

void refuse_null(const char* name) { throw ArgumentError(name, " is NULL."); }

void require_handle(const Handle& handle, HandleKind kind, const char* name) {
  if (!handle.handle_state().is_held_as(kind)) handle.handle_state().refuse(kind, name);
  if (handle.handle_state().is_of_parent()) throw ArgumentError(kIsOfParent);
}

void refuse_range(const TextPart& name, const TextPart& value, const TextPart& min, const TextPart& max) {
  throw ArgumentError({name, " is ", value, ", but must be ", min, " to ", max, "."});
}

void require_index(const char* name, uint32_t index, size_t count) {
  if (index >= count) throw ArgumentError(name, " is ", index, ", but there are ", count, " (from 0).");
}

void require_struct_size(const char* name, uint32_t size, size_t expected) {
  if (size != expected) {
    throw ArgumentError(name, ".struct_size is ", size, ", but this library expects ", expected,
                        " bytes; set it to sizeof the struct, or fill the struct with its _init function.");
  }
}

void require_provider(const TextPart& name, const maq_provider& provider) {
  require_range(name, number_in(provider), int32_t(MAQ_PROVIDER_CPU), int32_t(MAQ_PROVIDER_NNAPI));
}

void require_threads(const TextPart& name, int32_t threads, int32_t max) {
  if (threads == MAQ_THREADS_MEASURED || (threads >= 0 && threads <= max)) return;
  throw ArgumentError(
      {name, " is ", threads, ", but must be 0 to ", max, ", or MAQ_THREADS_MEASURED (", MAQ_THREADS_MEASURED, ")."});
}

}  // namespace maq
