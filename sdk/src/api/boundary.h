// The entry of every function of the C API: checks arguments, and turns exceptions into status and text.
#pragma once

#include <cstdint>
#include <cstring>
#include <new>
#include <string>
#include <type_traits>

#include "api/handle.h"
#include "core/error.h"

namespace maq {

// A wrong argument of a call of the C API: the text names the function too.
class ArgumentError : public Error {
 public:
  template <class... Parts>
  explicit ArgumentError(const Parts&... parts) : Error(MAQ_ERROR_INVALID_ARGUMENT, parts...) {}
};

// The texts that calls gave to a thread, so that no call waits for another and no text is freed while it is read.
struct ThreadTexts {
  std::string latest_error, returned_error;
  std::string pipeline_problem, pipeline_uri;  // of maq_pipeline_get_info
};

// Returns the texts of this thread; NULL where there is no memory for them. A thread_local object would end the process
// there: glibc cannot register its destructor.
ThreadTexts* thread_texts() noexcept;

// Keeps the text for maq_last_error: as the thread's latest, and with the handle unless that is NULL. `function`
// begins the text when it is not NULL.
maq_status keep_error(const Handle* handle, maq_status status, const char* function, const char* text) noexcept;

// The text of MAQ_ERROR_INVALID_ARGUMENT, which calls on an object of the parent process return.
extern const char kIsOfParent[];

// The text of the handle, or the thread's latest for NULL; it stays until the thread calls this again.
const char* last_error(const Handle* handle) noexcept;

// Runs `body`, which returns a status or throws. Nothing gets past this.
template <class Body>
maq_status guarded(const Handle* handle, const char* function, Body&& body) noexcept {
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

// Also checks that a handle has this type, belongs to this process and is held by the app.
template <class T>
void require_argument(const T* pointer, const char* name) {
  if (pointer == nullptr) throw ArgumentError(name, " is NULL.");
  if constexpr (std::is_base_of_v<Handle, T>) {
    if (!pointer->handle_state().is_held_as(T::kKind)) pointer->handle_state().refuse(T::kKind, name);
    if (pointer->handle_state().is_of_parent()) throw ArgumentError(kIsOfParent);
  }
}

// guarded() for functions that run one at a time on a handle: a second call at the same time, from another thread or
// from a callback of the first, is an ArgumentError.
template <class T, class Body>
maq_status guarded_alone(const T* handle, const char* name, const char* function, Body&& body) noexcept {
  // Until the error has been kept with the handle too.
  struct Call {
    HandleState* state;
    ~Call() {
      if (state != nullptr) state->end_call();
    }
  };
  const Call call{handle != nullptr && handle->handle_state().begin_call(T::kKind) ? &handle->handle_state() : nullptr};
  return guarded(handle, function, [&] {
    require_argument(handle, name);
    if (call.state == nullptr) {
      throw ArgumentError(name, " is in use by another call; let that return first, or make one for each thread.");
    }
    return body();
  });
}

enum class WhileInUse { kRefused, kAllowed };

// For `_destroy`, `_close` and `_release`: `reclaim` gets the handle unless it is NULL. The app keeps handles that it
// cannot give back: a handle of another type, one that was given back before, or one with a running call.
template <class T, class Reclaim>
void return_handle(T* handle, const char* name, const char* function, Reclaim&& reclaim,
                   WhileInUse while_in_use = WhileInUse::kRefused) noexcept {
  if (handle == nullptr) return;
  guarded(nullptr, function, [&] {
    if (handle->handle_state().is_of_parent()) return MAQ_OK;
    bool is_in_use = false;
    if (handle->handle_state().mark_returned(T::kKind, while_in_use == WhileInUse::kAllowed, is_in_use)) {
      reclaim(handle);
      return MAQ_OK;
    }
    if (is_in_use) throw ArgumentError(name, " is in use by another call, so it was not freed; let that return first.");
    handle->handle_state().refuse(T::kKind, name);
  });
}

template <class T>
void destroy(T* handle, const char* name, const char* function,
             WhileInUse while_in_use = WhileInUse::kRefused) noexcept {
  return_handle(
      handle, name, function, [](T* taken) { delete taken; }, while_in_use);
}

// Calls a function of the app, which must not throw. An exception that it throws in spite of this is the app's error.
template <class Call>
auto call_app(const char* name, Call&& call) {
  try {
    return call();
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw ArgumentError(name, " threw an exception (", error.what(), "); functions that the library calls must not.");
  } catch (...) {
    throw ArgumentError(name, " threw an exception; functions that the library calls must not.");
  }
}

// `name`: a text, also a std::string.
template <class Name, class T>
void require_range(const Name& name, T value, T min, T max) {
  if (!(value >= min && value <= max)) {
    throw ArgumentError(name, " is ", value, ", but must be ", min, " to ", max, ".");
  }
}

inline void require_index(const char* name, uint32_t index, size_t count) {
  if (index >= count) throw ArgumentError(name, " is ", index, ", but there are ", count, " (from 0).");
}

// Headers and library of one minor version agree on the size of each struct (maq_context_create checks the version), so
// another size means that the caller did not set struct_size.
inline void require_struct_size(const char* name, uint32_t size, size_t expected) {
  if (size != expected) {
    throw ArgumentError(name, ".struct_size is ", size, ", but this library expects ", expected,
                        " bytes; set it to sizeof the struct, or fill the struct with its _init function.");
  }
}

// The number that a caller wrote where an enum is expected. C allows any; reading one that the enum does not have is
// undefined in C++.
template <class Enum>
int32_t number_in(const Enum& value) {
  int32_t number;
  static_assert(sizeof number == sizeof value);
  std::memcpy(&number, &value, sizeof number);
  return number;
}

template <class Name>
void require_provider(const Name& name, const maq_provider& provider) {
  require_range(name, number_in(provider), int32_t(MAQ_PROVIDER_CPU), int32_t(MAQ_PROVIDER_NNAPI));
}

// For configs that accept MAQ_THREADS_MEASURED.
template <class Name>
void require_threads(const Name& name, int32_t threads, int32_t max) {
  if (threads == MAQ_THREADS_MEASURED || (threads >= 0 && threads <= max)) return;
  throw ArgumentError(name, " is ", threads, ", but must be 0 to ", max, ", or MAQ_THREADS_MEASURED (",
                      MAQ_THREADS_MEASURED, ").");
}

// Returns the caller's config, or the defaults for NULL.
template <class T>
T read_config(const T* given, const char* name, const T& defaults) {
  if (given == nullptr) return defaults;
  require_struct_size(name, given->struct_size, sizeof(T));
  return *given;
}

// Copies `value` to the caller's struct, whose struct_size was set by the caller.
template <class T>
void write_struct(T* target, const char* name, T value) {
  require_argument(target, name);
  require_struct_size(name, target->struct_size, sizeof(T));
  value.struct_size = sizeof(T);
  *target = value;
}

// Implements the `_init` functions, whose parameters are `name` and struct_size.
template <class T>
maq_status init_config(const char* function, T* config, uint32_t struct_size, const T& defaults,
                       const char* name = "config") {
  return guarded(nullptr, function, [&] {
    require_argument(config, name);
    if (struct_size != sizeof(T)) {
      throw ArgumentError("struct_size is ", struct_size, ", but this library expects ", sizeof(T),
                          " bytes; give sizeof the struct, of headers that fit the library.");
    }
    *config = defaults;
    config->struct_size = struct_size;
    return MAQ_OK;
  });
}

}  // namespace maq
