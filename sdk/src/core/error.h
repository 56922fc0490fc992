// Failure inside the library: a status and a sentence. src/api turns it into the C API's status and error text.
#pragma once

#include <initializer_list>
#include <new>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>

#include "maquette/types.h"

namespace maq {

// One value of a text, held by reference: it lives no longer than the call it is written in. Texts are put together in
// one place: code for it at each of the hundreds of places that throw made the library a twelfth larger.
class TextPart {
 public:
  TextPart(const char* text) : print_(print<const char*>), text_(text) {}
  template <class T>
  TextPart(const T& value) : print_(print<T>), value_(&value) {}

  void write(std::ostream& text) const { print_(text, *this); }

 private:
  template <class T>
  static void print(std::ostream& text, const TextPart& part) {
    if constexpr (std::is_same_v<T, const char*>) {
      text << part.text_;
    } else {
      text << *static_cast<const T*>(part.value_);
    }
  }

  void (*print_)(std::ostream&, const TextPart&);
  union {
    const char* text_;
    const void* value_;
  };
};

// Writes numbers in the C locale, for any locale of the app: 1234.5, not 1.234,5.
std::string join(std::initializer_list<TextPart> parts);

template <class... Parts>
[[gnu::always_inline]] inline std::string concatenate(const Parts&... parts) {
  return join({TextPart(parts)...});
}

class Error : public std::runtime_error {
 public:
  template <class... Parts>
  [[gnu::always_inline]] explicit Error(maq_status status, const Parts&... parts)
      : Error(status, std::initializer_list<TextPart>{TextPart(parts)...}) {}
  Error(maq_status status, std::initializer_list<TextPart> parts);

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
Failure current_failure() noexcept;

// Whether the text of a foreign library's error says that there was no memory.
bool says_out_of_memory(std::string_view text);

}  // namespace maq
