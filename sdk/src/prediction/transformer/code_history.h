// What the latest frames of a stream were, by their times: their codes, or small pictures.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace maq {

// Of uint16_t or uint8_t.
template <class Value>
class FrameHistory {
 public:
  static constexpr size_t kKept = 16;

  // `count`: values of a frame.
  explicit FrameHistory(size_t count) : count_(count), values_(kKept * count) {}

  void add(const Value* values, int64_t time_ns);
  void clear() { size_ = 0; }

  size_t size() const { return size_; }
  int64_t newest_ns() const { return at(0).time_ns; }
  // Values of the newest frame, and of those that are as far apart in time as the newest is from `coming_ns`, each
  // within half of that: frames may be missing, and need not be evenly spaced. `frames`: `wanted` of them, the oldest
  // first; null from the first one on, going back, that is not there.
  void select(int64_t coming_ns, size_t wanted, const Value** frames) const;

 private:
  struct Known {
    const Value* values;
    int64_t time_ns;
  };
  // The newest is 0.
  Known at(size_t age) const {
    const size_t slot = (next_ + kKept - 1 - age) % kKept;
    return {values_.data() + slot * count_, times_ns_[slot]};
  }

  size_t count_;
  std::vector<Value> values_;
  std::array<int64_t, kKept> times_ns_{};
  size_t next_ = 0, size_ = 0;
};

using CodeHistory = FrameHistory<uint16_t>;
using PictureHistory = FrameHistory<uint8_t>;

}  // namespace maq
