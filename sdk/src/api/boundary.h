// What every function of the C API goes through: argument checks, and exceptions turned into status and text.
#pragma once

#include <cstdint>
#include <cstring>
#include <new>
#include <string>

#include "api/handle.h"
#include "core/error.h"

namespace maq {

// A wrong argument of a call of the C API: the text names the function too.
class ArgumentError : public Error {
 public:
  template <class... Parts>
  explicit ArgumentError(const Parts&... parts) : Error(MAQ_ERROR_INVALID_ARGUMENT, parts...) {}
};

// Keeps the text for maq_last_error: as the thread's latest, and with the handle unless that is NULL. `function`
// begins the text when it is not NULL.
maq_status keep_error(const Handle* handle, maq_status status, const char* function, const char* text) noexcept;

// The text of what a call on an object of the parent process returns, which is MAQ_ERROR_INVALID_ARGUMENT.
extern const char kIsOfParent[];

// The text of the handle, or the thread's latest for NULL; it stays until the thread calls this again.
const char* last_error(const Handle* handle) noexcept;

// Runs `body`, which returns a status or throws. Nothing gets past this.
template <class Body>
maq_status guarded(const Handle* handle, const char* function, Body&& body) noexcept {
  try {
    if (handle != nullptr && handle->is_of_parent()) {
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

template <class T>
void require_argument(const T* pointer, const char* name) {
  if (pointer == nullptr) throw ArgumentError(name, " is NULL.");
}

template <class T>
void require_range(const char* name, T value, T min, T max) {
  if (!(value >= min && value <= max)) {
    throw ArgumentError(name, " is ", value, ", but must be ", min, " to ", max, ".");
  }
}

inline void require_index(const char* name, uint32_t index, size_t count) {
  if (index >= count) throw ArgumentError(name, " is ", index, ", but there are ", count, " (from 0).");
}

// Structs grow at their end. `smallest` is the size of the struct's first release: whatever lies between that and this
// library's size is an older struct; a larger one comes from newer headers and may ask for what this library cannot do.
inline void require_struct_size(const char* name, uint32_t size, size_t smallest, size_t largest) {
  if (size < smallest || size > largest) {
    throw ArgumentError(name, ".struct_size is ", size, ", but this library knows ", smallest, " to ", largest,
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

// The caller's config on top of the defaults.
template <class T>
T read_config(const T* given, const char* name, const T& defaults, size_t smallest) {
  T config = defaults;
  if (given == nullptr) return config;
  require_struct_size(name, given->struct_size, smallest, sizeof(T));
  std::memcpy(&config, given, given->struct_size);
  return config;
}

// As much of `value` as the caller's struct has room for; its struct_size stays.
template <class T>
void write_struct(T* target, const char* name, T value, size_t smallest) {
  require_argument(target, name);
  require_struct_size(name, target->struct_size, smallest, sizeof(T));
  value.struct_size = target->struct_size;
  std::memcpy(target, &value, target->struct_size);
}

// For the `_init` functions.
template <class T>
maq_status init_config(const char* function, T* config, uint32_t struct_size, const T& defaults, size_t smallest) {
  return guarded(nullptr, function, [&] {
    require_argument(config, "config");
    require_struct_size("config", struct_size, smallest, sizeof(T));
    T filled = defaults;
    filled.struct_size = struct_size;
    std::memcpy(config, &filled, struct_size);
    return MAQ_OK;
  });
}

}  // namespace maq
