#include "core/files/file_reader.h"

#include <charconv>
#include <cmath>
#include <cstdlib>

#include "core/files/file_calls.h"

namespace maq {
namespace {

constexpr size_t kBufferBytes = 1 << 16;

bool is_space(int character) { return character == ' ' || (character >= '\t' && character <= '\r'); }

}  // namespace

FileReader::FileReader(std::string path)
    : path_(std::move(path)), file_(open_file(path_)), buffer_(std::make_unique<uint8_t[]>(kBufferBytes)) {}

bool FileReader::fill() {
  buffer_offset_ += position_;
  position_ = filled_ = 0;
  const size_t count = size_t(std::min<uint64_t>(kBufferBytes, file_.size_bytes - buffer_offset_));
  while (filled_ < count) {
    const ptrdiff_t got = read_at(file_.fd.get(), buffer_offset_ + filled_, buffer_.get() + filled_, count - filled_);
    if (got <= 0) fail(" cannot be read to its end; did it change meanwhile?");
    filled_ += size_t(got);
  }
  return filled_ > 0;
}

void FileReader::read_over_the_end(uint8_t* bytes, size_t count) {
  if (count > remaining()) fail(" ends early: it is truncated or damaged; copy it again.");
  while (count > 0) {
    if (position_ == filled_) fill();
    const size_t part = std::min(count, filled_ - position_);
    std::memcpy(bytes, buffer_.get() + position_, part);
    position_ += part;
    bytes += part;
    count -= part;
  }
}

void FileReader::skip(uint64_t count) {
  if (count > remaining()) fail(" ends early: it is truncated or damaged; copy it again.");
  if (count <= filled_ - position_) {
    position_ += size_t(count);
    return;
  }
  buffer_offset_ += position_ + count;
  position_ = filled_ = 0;
}

int FileReader::next_character() {
  if (position_ == filled_ && !fill()) return -1;
  return buffer_[position_++];
}

bool FileReader::next_line(std::string& line, size_t max_bytes) {
  line.clear();
  bool is_there = false;
  while (position_ < filled_ || fill()) {
    is_there = true;
    const uint8_t* begin = buffer_.get() + position_;
    const auto* end = static_cast<const uint8_t*>(std::memchr(begin, '\n', filled_ - position_));
    const size_t count = end == nullptr ? filled_ - position_ : size_t(end - begin);
    const size_t kept = std::min(count, max_bytes - std::min(max_bytes, line.size()));
    line.append(reinterpret_cast<const char*>(begin), kept);
    position_ += count;
    if (end == nullptr) continue;
    ++position_;
    break;
  }
  if (!line.empty() && line.back() == '\r') line.pop_back();
  if (is_there) ++line_;
  return is_there;
}

std::string_view FileReader::next_word() {
  int character;
  do {
    if (ended_line_) ++line_;
    character = next_character();
    ended_line_ = character == '\n';
  } while (is_space(character));
  size_t length = 0;
  while (character >= 0 && !is_space(character)) {
    if (length == word_.size()) fail(", line ", line_, ": there is a word of over ", word_.size(), " letters.");
    word_[length++] = char(character);
    character = next_character();
  }
  ended_line_ = character == '\n';
  return {word_.data(), length};
}

#if defined(__cpp_lib_to_chars) && !defined(MAQ_WITHOUT_FLOAT_FROM_CHARS)

bool parse_number(std::string_view text, double& number) {
  if (!text.empty() && text[0] == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc::result_out_of_range) {
    // Like strtod: an underflow is 0, an overflow is infinite.
    const bool is_small = text.find("e-") != std::string_view::npos || text.find("E-") != std::string_view::npos;
    number = is_small ? 0 : HUGE_VAL;
    return end == text.data() + text.size();
  }
  return error == std::errc() && end == text.data() + text.size();
}

#else  // libc++ before release 20, which Android's compilers have; there strtod always takes the point of C

bool parse_number(std::string_view text, double& number) {
  if (!text.empty() && text[0] == '+') text.remove_prefix(1);
  // Refuses forms that strtod accepts: space before the number, a second sign, hexadecimal numbers.
  if (text.empty() || is_space(text[0]) || text[0] == '+' || text.find_first_of("xX") != text.npos) return false;
  const std::string word(text);
  char* end = nullptr;
  number = std::strtod(word.c_str(), &end);
  return end == word.c_str() + word.size();
}

#endif

}  // namespace maq
