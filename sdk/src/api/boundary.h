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
  [[gnu::always_inline]] explicit ArgumentError(const Parts&... parts)
      : ArgumentError(std::initializer_list<TextPart>{TextPart(parts)...}) {}
  explicit ArgumentError(std::initializer_list<TextPart> parts);
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

// A function without arguments that returns a status or throws, of any type.
class Call {
 public:
  template <class Body>
  explicit Call(Body& body)
      : body_(&body), run_([](const void* found) { return (*static_cast<Body*>(const_cast<void*>(found)))(); }) {}

  maq_status operator()() const { return run_(body_); }

 private:
  const void* body_;
  maq_status (*run_)(const void*);
};

// Runs `body`, which returns a status or throws. Nothing gets past this.
maq_status run_guarded(const Handle* handle, const char* function, const Call& body) noexcept;
template <class Body>
maq_status guarded(const Handle* handle, const char* function, Body&& body) noexcept {
  return run_guarded(handle, function, Call(body));
}

[[noreturn]] void refuse_null(const char* name);

// Checks that a handle has this kind, belongs to this process and is held by the app.
void require_handle(const Handle& handle, HandleKind kind, const char* name);

template <class T>
void require_argument(const T* pointer, const char* name) {
  if (pointer == nullptr) refuse_null(name);
  if constexpr (std::is_base_of_v<Handle, T>) require_handle(*pointer, T::kKind, name);
}

// guarded() for functions that run one at a time on a handle: a second call at the same time, from another thread or
// from a callback of the first, is an ArgumentError.
maq_status run_alone(const Handle* handle, HandleKind kind, const char* name, const char* function,
                     const Call& body) noexcept;

template <class T, class Body>
maq_status guarded_alone(const T* handle, const char* name, const char* function, Body&& body) noexcept {
  return run_alone(handle, T::kKind, name, function, Call(body));
}

enum class WhileInUse { kRefused, kAllowed };

// For `_destroy`, `_close` and `_release`: `reclaim` gets the handle unless it is NULL. The app keeps handles that it
// cannot give back: a handle of another type, one that was given back before, or one with a running call.
void reclaim_handle(Handle* handle, HandleKind kind, const char* name, const char* function, const Call& reclaim,
                    WhileInUse while_in_use) noexcept;

template <class T, class Reclaim>
struct Reclaiming {
  maq_status operator()() const {
    reclaim(handle);
    return MAQ_OK;
  }
  T* handle;
  Reclaim& reclaim;
};

template <class T, class Reclaim>
void return_handle(T* handle, const char* name, const char* function, Reclaim&& reclaim,
                   WhileInUse while_in_use = WhileInUse::kRefused) noexcept {
  const Reclaiming<T, Reclaim> call{handle, reclaim};
  reclaim_handle(handle, T::kKind, name, function, Call(call), while_in_use);
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

[[noreturn]] void refuse_range(const TextPart& name, const TextPart& value, const TextPart& min, const TextPart& max);

// `name`: a text, also a std::string.
template <class T>
void require_range(const TextPart& name, T value, T min, T max) {
  if (!(value >= min && value <= max)) refuse_range(name, value, min, max);
}

void require_index(const char* name, uint32_t index, size_t count);

// Headers and library of one minor version agree on the size of each struct (maq_context_create checks the version), so
// another size means that the caller did not set struct_size.
void require_struct_size(const char* name, uint32_t size, size_t expected);

// The number that a caller wrote where an enum is expected. C allows any; reading one that the enum does not have is
// undefined in C++.
template <class Enum>
int32_t number_in(const Enum& value) {
  int32_t number;
  static_assert(sizeof number == sizeof value);
  std::memcpy(&number, &value, sizeof number);
  return number;
}

void require_provider(const TextPart& name, const maq_provider& provider);

// For configs that accept MAQ_THREADS_MEASURED.
void require_threads(const TextPart& name, int32_t threads, int32_t max);

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
