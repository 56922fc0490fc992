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

// With the numbers of C, whatever the locale of the app: 1234.5, not 1.234,5.
template <class... Parts>
std::string concatenate(const Parts&... parts) {
  std::ostringstream text;
  text.exceptions(std::ios::badbit);  // what throws without memory, where the text would end early
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

// The same where there is none even for a text: strings hold so few letters themselves.
inline constexpr char kShortNoMemory[] = "Out of memory.";

struct Failure {
  maq_status status;
  const char* text;  // of the exception, while that lives, or static
};

// What the exception means that is being handled: to be called in the catch block. MAQ_ERROR_INTERNAL for what the
// library does not throw itself.
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
