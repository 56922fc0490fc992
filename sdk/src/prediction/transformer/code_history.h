// Keeps the codes of the latest frames of a stream with their times.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace maq {

class CodeHistory {
 public:
  static constexpr size_t kKept = 16;

  // `count`: values per frame.
  explicit CodeHistory(size_t count) : count_(count), values_(kKept * count) {}

  void add(const uint16_t* values, int64_t time_ns);
  void clear() { size_ = 0; }

  size_t size() const { return size_; }
  int64_t newest_ns() const { return at(0).time_ns; }
  // Selects `wanted` frames into `frames`, the oldest first. Their spacing is the time from the newest frame to
  // `target_ns`; each may be off by half of that, so that frames may be missing. Null from the first missing one back.
  void select(int64_t target_ns, size_t wanted, const uint16_t** frames) const;

 private:
  struct Known {
    const uint16_t* values;
    int64_t time_ns;
  };
  // `age`: 0 is the newest.
  Known at(size_t age) const {
    const size_t slot = (next_ + kKept - 1 - age) % kKept;
    return {values_.data() + slot * count_, times_ns_[slot]};
  }

  size_t count_;
  std::vector<uint16_t> values_;
  std::array<int64_t, kKept> times_ns_{};
  size_t next_ = 0, size_ = 0;
};

}  // namespace maq
