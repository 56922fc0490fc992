// Failure inside the library: a status and a sentence. src/api turns it into the C API's status and error text.
#pragma once

#include <locale>
#include <sstream>
#include <stdexcept>
#include <string>

#include "maquette/types.h"

namespace maq {

// With the numbers of C, whatever the locale of the app: 1234.5, not 1.234,5.
template <class... Parts>
std::string concatenate(const Parts&... parts) {
  std::ostringstream text;
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

}  // namespace maq
