// A file read from front to back as numbers, words or lines, in memory of fixed size whatever the file claims.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/files/file.h"

namespace maq {

enum class ByteOrder { kLittle, kBig };

class FileReader {
 public:
  // Throws the errors of open_file().
  explicit FileReader(std::string path);

  const std::string& path() const { return path_; }
  // Bytes that have not been read or skipped yet.
  uint64_t remaining() const { return file_.size_bytes - buffer_offset_ - position_; }
  // Returns the number of the latest line, from 1.
  uint64_t line() const { return line_; }

  // Both throw MAQ_ERROR_UNREADABLE when the file ends before.
  void read(void* bytes, size_t count) {
    if (count == 0) return;  // `bytes` may be null
    if (count > filled_ - position_) return read_over_the_end(static_cast<uint8_t*>(bytes), count);
    std::memcpy(bytes, buffer_.get() + position_, count);
    position_ += count;
  }
  void skip(uint64_t count);

  template <class Number>
  Number number(ByteOrder order = ByteOrder::kLittle) {
    std::array<uint8_t, sizeof(Number)> bytes;
    read(bytes.data(), bytes.size());
    if (order == ByteOrder::kBig) std::reverse(bytes.begin(), bytes.end());
    Number number;
    std::memcpy(&number, bytes.data(), sizeof number);
    return number;
  }

  // The next line without its end ("\n" or "\r\n"), cut after `max_bytes`. False at the end of the file.
  bool next_line(std::string& line, size_t max_bytes);

  // The next word between white space, valid until the next call; empty at the end of the file. Throws
  // MAQ_ERROR_UNREADABLE when it is longer than any number.
  std::string_view next_word();

  // Throws MAQ_ERROR_UNREADABLE: the path, then the fault.
  template <class... Parts>
  [[noreturn]] void fail(const Parts&... parts) const {
    throw Error(MAQ_ERROR_UNREADABLE, path_, parts...);
  }

 private:
  void read_over_the_end(uint8_t* bytes, size_t count);
  bool fill();           // false at the end of the file
  int next_character();  // -1 at the end of the file

  std::string path_;
  OpenFile file_;
  uint64_t buffer_offset_ = 0;  // position of the buffer's first byte in the file
  std::unique_ptr<uint8_t[]> buffer_;
  size_t position_ = 0, filled_ = 0;
  uint64_t line_ = 0;
  std::array<char, 64> word_{};
  bool ended_line_ = true;
};

// Reads the whole text as a number, in the C locale, whatever the locale of the process; false if it is not a number.
bool parse_number(std::string_view text, double& number);

}  // namespace maq
