// Random numbers that are the same on every platform, unlike the distributions of <random>.
#pragma once

#include <cstdint>

namespace maq {

// SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014).
inline uint64_t mixed_bits(uint64_t z) {
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return z ^ z >> 31;
}

class Dice {
 public:
  explicit Dice(uint64_t seed) : state_(seed) {}

  double between(double low, double high) { return low + (high - low) * (double(next() >> 11) / 9007199254740992.0); }
  int below(int limit) { return int(next() % uint64_t(limit)); }

 private:
  uint64_t next() { return mixed_bits(state_ += 0x9e3779b97f4a7c15u); }

  uint64_t state_;
};

}  // namespace maq
