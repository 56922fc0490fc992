// The bytes of a file that begins with a magic, sizes and a checksum, read from front to back. export/checked_file.py
// writes such files. Numbers are little-endian, as on every machine that the SDK runs on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "core/error.h"

namespace maq {

// The head of such a file.
struct FileStart {
  char magic[8];
  uint32_t version;
  uint32_t head_bytes;  // size of the whole struct that begins with this
  uint64_t check;       // 64-bit XXH3 of all that follows in the file
  uint64_t file_bytes;
};
inline constexpr size_t kCheckedFrom = offsetof(FileStart, file_bytes);

class CheckedBytes {
 public:
  // `name` begins each sentence: "prior.maqp". `damage`: the status for unusable bytes. The bytes stay the caller's.
  CheckedBytes(const void* bytes, size_t count, std::string name, maq_status damage)
      : bytes_(static_cast<const uint8_t*>(bytes)), left_(count), name_(std::move(name)), damage_(damage) {}

  // Reads a head, and checks the start of the file and its checksum. `kind`: "a prior of heads (.maqp)". `remedy`: the
  // remedy for another version. Throws `damage`, and MAQ_ERROR_UNSUPPORTED for another version.
  template <class Head>
  Head head(const char (&magic)[8], uint32_t version, const char* kind, const char* remedy) {
    check_start(magic, version, sizeof(Head), kind, remedy);
    return number<Head>();
  }

  size_t left() const { return left_; }

  // Throws `damage` when the bytes end before, as all of these do.
  template <class Number>
  Number number() {
    Number number;
    std::memcpy(&number, take(sizeof number), sizeof number);
    return number;
  }
  std::vector<uint8_t> bytes(size_t count) {
    const uint8_t* const from = take(count);
    return {from, from + count};
  }
  // Reads float32. Throws for a number that is not finite, or too large.
  std::vector<float> floats(size_t count);

  // A number of the head that must be 1 to `max`. `what`: "slices".
  size_t size_within(uint32_t value, size_t max, const char* what) const {
    if (value < 1 || value > max) fail(" has ", value, " ", what, "; 1 to ", max, " are allowed.");
    return value;
  }

  // Throws unless everything was read.
  void end() const;

  template <class... Parts>
  [[noreturn]] void fail(const Parts&... parts) const {
    throw Error(damage_, name_, parts...);
  }

 protected:
  const uint8_t* take(size_t count);
  // Throws before it takes memory for missing bytes.
  void require_left(size_t count, size_t size_of_one) const {
    if (count > left_ / size_of_one) fail(" ends before what its head claims.");
  }
  void check_floats(const float* values, size_t count) const;

 private:
  void check_start(const char (&magic)[8], uint32_t version, size_t head_bytes, const char* kind,
                   const char* remedy) const;

  const uint8_t* bytes_;
  size_t left_;
  std::string name_;
  maq_status damage_;
};

// Makes the start of `file`, whose head was written first, say how long all is, and its check.
void sign_file(std::vector<uint8_t>& file, size_t head_bytes, const char (&magic)[8], uint32_t version);

}  // namespace maq
