// A fuzz target: a reader of bytes from outside, which must refuse or accept any bytes without a fault.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <string>
#include <vector>

#include "core/error.h"

namespace fuzz {

using Bytes = std::vector<uint8_t>;

struct Target {
  Target(const char* name_given, void (*run_given)(const Bytes&), std::vector<Bytes> (*seeds_given)() = nullptr);
  static std::vector<const Target*>& all();

  const char* name;
  void (*run)(const Bytes&);      // in memory of exactly that length
  std::vector<Bytes> (*seeds)();  // valid inputs that no file of the tests holds
};

// Ends the program, so that the driver writes the input down.
inline void require(bool is_right, const char* what) {
  if (is_right) return;
  std::fprintf(stderr, "Wrong: %s\n", what);
  std::abort();
}

// Runs `call`, which may throw an error with one of these statuses and no other exception.
template <class Call>
void run_or_refuse(std::initializer_list<maq_status> allowed, Call&& call) {
  try {
    call();
  } catch (const maq::Error& error) {
    const bool is_allowed = std::find(allowed.begin(), allowed.end(), error.status()) != allowed.end();
    if (!is_allowed) std::fprintf(stderr, "Status %d: %s\n", int(error.status()), error.what());
    require(is_allowed, "a status that the header does not name");
  }
}

inline std::string text_of(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }
inline Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

// Numbers from the start of an input on; 0 behind its end.
class Numbers {
 public:
  explicit Numbers(const Bytes& bytes) : bytes_(bytes) {}

  template <class Number>
  Number take() {
    Number number{};
    const size_t count = std::min(sizeof number, bytes_.size() - at_);
    if (count > 0) std::memcpy(&number, bytes_.data() + at_, count);
    at_ += count;
    return number;
  }
  int within(int min, int max) { return min + int(take<uint16_t>() % uint32_t(max - min + 1)); }
  std::vector<float> floats(size_t count) {
    std::vector<float> numbers(count);
    for (float& number : numbers) number = take<float>();
    return numbers;
  }
  Bytes bytes(size_t count) {
    const size_t begin = at_;
    at_ = std::min(at_ + count, bytes_.size());
    return {bytes_.begin() + ptrdiff_t(begin), bytes_.begin() + ptrdiff_t(at_)};
  }
  Bytes rest() { return bytes(bytes_.size()); }

 private:
  const Bytes& bytes_;
  size_t at_ = 0;
};

// The reverse of Numbers, for seeds.
class Writer {
 public:
  template <class Number>
  Writer& add(Number number) {
    const auto* const from = reinterpret_cast<const uint8_t*>(&number);
    bytes.insert(bytes.end(), from, from + sizeof number);
    return *this;
  }
  Writer& within(int value, int min) { return add(uint16_t(value - min)); }
  Writer& text(const std::string& text) {
    bytes.insert(bytes.end(), text.begin(), text.end());
    return *this;
  }

  Bytes bytes;
};

// A file in memory, for readers that open a path.
class MemoryFile {
 public:
  explicit MemoryFile(const Bytes& bytes) : file_(memfd_create("fuzz", MFD_CLOEXEC)) {
    require(file_ >= 0 && write(file_, bytes.data(), bytes.size()) == ssize_t(bytes.size()), "the memory of a file");
  }
  ~MemoryFile() { close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  int file_;
};

}  // namespace fuzz

// FUZZ(name) { … } defines the target `name`, whose input is `bytes`. SEEDED_FUZZ(name, seeds) has seeds of its own.
#define SEEDED_FUZZ(name, seeds)                                      \
  static void fuzz_##name(const fuzz::Bytes& bytes);                  \
  static const fuzz::Target target_##name(#name, fuzz_##name, seeds); \
  static void fuzz_##name([[maybe_unused]] const fuzz::Bytes& bytes)
#define FUZZ(name) SEEDED_FUZZ(name, nullptr)
