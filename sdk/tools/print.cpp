#include "print.h"

#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>

namespace {

// Bytes of the UTF-8 character at `at` (Unicode 15, table 3-7); 0 where there is none.
size_t character_bytes(const std::string& text, size_t at) {
  const auto byte = [&](size_t i) { return at + i < text.size() ? uint8_t(text[at + i]) : uint8_t(0); };
  const auto follows = [&](size_t i) { return byte(i) >= 0x80 && byte(i) <= 0xbf; };
  const uint8_t first = byte(0);
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first <= 0xdf) return follows(1) ? 2 : 0;
  if (first >= 0xe0 && first <= 0xef) {
    const bool is_overlong = first == 0xe0 && byte(1) < 0xa0, is_surrogate = first == 0xed && byte(1) > 0x9f;
    return follows(1) && follows(2) && !is_overlong && !is_surrogate ? 3 : 0;
  }
  if (first >= 0xf0 && first <= 0xf4) {
    const bool is_overlong = first == 0xf0 && byte(1) < 0x90, is_too_large = first == 0xf4 && byte(1) > 0x8f;
    return follows(1) && follows(2) && follows(3) && !is_overlong && !is_too_large ? 4 : 0;
  }
  return 0;
}

// C0, DEL, and C1, which some terminals obey also as UTF-8.
bool is_control(const std::string& text, size_t at, size_t bytes) {
  const auto first = uint8_t(text[at]);
  if (bytes == 1) return first < 0x20 || first == 0x7f;
  return bytes == 2 && first == 0xc2 && uint8_t(text[at + 1]) <= 0x9f;
}

std::string made_printable(const std::string& text, bool keeps_line_ends) {
  std::string result;
  for (size_t at = 0; at < text.size();) {
    const size_t bytes = character_bytes(text, at);
    if (bytes > 0 && (!is_control(text, at, bytes) || (keeps_line_ends && text[at] == '\n'))) {
      result.append(text, at, bytes);
      at += bytes;
      continue;
    }
    char escape[8];
    std::snprintf(escape, sizeof escape, "\\x%02x", unsigned(uint8_t(text[at])));
    result += escape;
    ++at;
  }
  return result;
}

std::string formatted(const char* format, va_list arguments) {
  va_list again;
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, arguments);
  std::string text(size_t(length < 0 ? 0 : length) + 1, '\0');
  std::vsnprintf(text.data(), text.size(), format, again);
  va_end(again);
  text.pop_back();
  return made_printable(text, true);
}

}  // namespace

OutputLost::OutputLost(int reason)
    : std::runtime_error(std::string("Standard output cannot be written: ") + std::strerror(reason) + ".") {}

std::string printable(const std::string& text) { return made_printable(text, false); }

void print_output(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  const std::string text = formatted(format, arguments);
  va_end(arguments);
  print_unchanged(text);
}

void print_unchanged(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) throw OutputLost(errno);
}

void flush_output() {
  errno = 0;
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) throw OutputLost(errno != 0 ? errno : EIO);
}

void print_error(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  std::fputs(formatted(format, arguments).c_str(), stderr);
  va_end(arguments);
}
