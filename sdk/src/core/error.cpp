#include "core/error.h"

#include <array>
#include <locale>
#include <sstream>

namespace maq {

std::string join(std::initializer_list<TextPart> parts) {
  std::ostringstream text;
  text.exceptions(std::ios::badbit);  // throws without memory; otherwise the text would end early
  text.imbue(std::locale::classic());
  for (const TextPart& part : parts) part.write(text);
  return text.str();
}

Error::Error(maq_status status, std::initializer_list<TextPart> parts)
    : std::runtime_error(join(parts)), status_(status) {}

Failure current_failure() noexcept {
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

bool says_out_of_memory(std::string_view text) {
  // std::bad_alloc, ONNX Runtime's arena and strerror(ENOMEM), glibc's loader, libjpeg.
  constexpr std::array<std::string_view, 5> kWords = {"bad_alloc", "llocate memory", "emory alloc", "ut of memory",
                                                      "nsufficient memory"};
  for (const std::string_view words : kWords) {
    if (text.find(words) != std::string_view::npos) return true;
  }
  return false;
}

}  // namespace maq
