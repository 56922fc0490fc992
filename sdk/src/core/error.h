// Failure inside the library: a status and a sentence. src/api turns it into the C API's status and error text.
#pragma once

#include <locale>
#include <new>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>

#include "maquette/types.h"

namespace maq {

// Writes numbers in the C locale, for any locale of the app: 1234.5, not 1.234,5.
template <class... Parts>
std::string concatenate(const Parts&... parts) {
  std::ostringstream text;
  text.exceptions(std::ios::badbit);  // throws without memory; otherwise the text would end early
  text.imbue(std::locale::classic());
  (text << ... << parts);
  return text.str();
}

class Error : public std::runtime_error {
 public:
  template <class... Parts>
  explicit Error(maq_status status, const Parts&... parts)
      : std::runtime_error(concatenate(parts...)), status_(status) {}

  maq_status status() const noexcept { return status_; }

 private:
  maq_status status_;
};

inline constexpr char kNoMemory[] = "There is not enough memory. Free memory, or raise the limit of it.";

// The text for the case without memory for a longer one: a string stores so few letters inline.
inline constexpr char kShortNoMemory[] = "Out of memory.";

struct Failure {
  maq_status status;
  const char* text;  // valid as long as the exception, or static
};

// Returns the status and text of the exception being handled. Call it in the catch block. Exceptions from outside the
// library are MAQ_ERROR_INTERNAL.
inline Failure current_failure() noexcept {
  try {
    throw;
  } catch (const Error& error) {
    return {error.status(), error.what()};
  } catch (const std::bad_alloc&) {
    return {MAQ_ERROR_OUT_OF_MEMORY, kNoMemory};
  } catch (const std::system_error& error) {
    const bool is_memory = error.code() == std::errc::not_enough_memory;
    return {is_memory ? MAQ_ERROR_OUT_OF_MEMORY : MAQ_ERROR_INTERNAL, is_memory ? kNoMemory : error.what()};
  } catch (const std::exception& error) {
    return {MAQ_ERROR_INTERNAL, error.what()};
  } catch (...) {
    return {MAQ_ERROR_INTERNAL, "An unknown exception was thrown."};
  }
}

}  // namespace maq
