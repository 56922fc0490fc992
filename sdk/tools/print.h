// Text on standard output and standard error. Names of files, cameras and URIs come from strangers, so control
// characters and bytes that are no UTF-8 appear as \x1b, and a terminal does nothing on them. Text that cannot be
// written is an error: a full disk behind `>`, a pipe whose reader is gone.
#pragma once

#include <stdexcept>
#include <string>

#if defined(_WIN32)
#define MAQ_FORMAT_KIND gnu_printf  // of MinGW's library; that of Windows has other formats
#else
#define MAQ_FORMAT_KIND printf
#endif

class OutputLost : public std::runtime_error {
 public:
  explicit OutputLost(int reason);  // errno
};

// The text with control characters, line ends too, and bytes that are no UTF-8 as \x and two digits.
std::string printable(const std::string& text);

// As printf, but made printable apart from line ends. Throws OutputLost, at the latest at the next flush_output().
[[gnu::format(MAQ_FORMAT_KIND, 1, 2)]] void print_output(const char* format, ...);
// Writes text with its control characters. Throws OutputLost too.
void print_unchanged(const std::string& text);
// Throws OutputLost.
void flush_output();

// The same on standard error; text that cannot be written there is lost.
[[gnu::format(MAQ_FORMAT_KIND, 1, 2)]] void print_error(const char* format, ...);
