// Changes to inputs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <random>

#include "fuzz_target.h"

namespace fuzz {

class Mutator {
 public:
  Mutator(uint64_t seed, size_t max_bytes) : random_(seed), max_bytes_(max_bytes) {}

  size_t below(size_t count) { return size_t(random_() % std::max<size_t>(count, 1)); }

  // `bytes` with one to eight changes; parts of `other` may come into it.
  Bytes changed(Bytes bytes, const Bytes& other) {
    for (size_t left = size_t(1) << below(4); left > 0; --left) change(bytes, other);
    if (bytes.size() > max_bytes_) bytes.resize(max_bytes_);
    return bytes;
  }

 private:
  // Numbers at the ends of their types, infinities and NaN, small and large counts.
  uint64_t odd_number() {
    static constexpr uint64_t kOdd[] = {0,
                                        1,
                                        2,
                                        7,
                                        0x7f,
                                        0x80,
                                        0xff,
                                        0x100,
                                        512,
                                        0x7fff,
                                        0x8000,
                                        0xffff,
                                        0x10000,
                                        0x7fffffff,
                                        0x80000000,
                                        0xffffffff,
                                        0x7f800000,
                                        0xff800000,
                                        0x7fc00000,
                                        0x7f7fffff,
                                        0x7c00,
                                        0xfc00,
                                        0x7e00,
                                        0x7ff0000000000000,
                                        0x7ff8000000000000,
                                        0xffffffffffffffff};
    return below(4) == 0 ? random_() : kOdd[below(std::size(kOdd))];
  }

  // Heads of files decide most: a third of all places are among the first 256 bytes.
  size_t place(const Bytes& bytes) { return below(below(3) == 0 ? std::min<size_t>(bytes.size(), 256) : bytes.size()); }

  void change(Bytes& bytes, const Bytes& other) {
    if (bytes.empty()) bytes.push_back(0);
    const size_t at = place(bytes), width = size_t(1) << below(4);
    switch (below(8)) {
      case 0: bytes[at] = uint8_t(bytes[at] ^ (1u << below(8))); break;
      case 1: bytes[at] = uint8_t(random_()); break;
      case 2: {  // a number, at its place or anywhere
        const size_t start = below(2) == 0 ? at / width * width : at;
        const uint64_t value = odd_number();
        std::memcpy(bytes.data() + start, &value, std::min(width, bytes.size() - start));
        break;
      }
      case 3: {  // a little more or less
        const size_t count = std::min(width, bytes.size() - at);
        uint64_t value = 0;
        std::memcpy(&value, bytes.data() + at, count);
        value += below(33) - 16;
        std::memcpy(bytes.data() + at, &value, count);
        break;
      }
      case 4: {  // removed
        const size_t count = below(std::min<size_t>(bytes.size() - at, 64)) + 1;
        bytes.erase(bytes.begin() + std::ptrdiff_t(at),
                    bytes.begin() + std::ptrdiff_t(std::min(at + count, bytes.size())));
        break;
      }
      case 5:  // put in
        bytes.insert(bytes.begin() + std::ptrdiff_t(at), below(32) + 1, uint8_t(below(2) == 0 ? 0 : random_()));
        break;
      case 6: {  // a part of another input, or of this one
        const Bytes source = below(2) == 0 || other.empty() ? bytes : other;
        const size_t from = below(source.size());
        const size_t count = std::min({below(128) + 1, source.size() - from, bytes.size() - at});
        std::copy_n(source.begin() + std::ptrdiff_t(from), count, bytes.begin() + std::ptrdiff_t(at));
        break;
      }
      default:  // cut, rarely
        if (below(4) == 0) bytes.resize(at);
    }
  }

  std::mt19937_64 random_;
  size_t max_bytes_;
};

}  // namespace fuzz
