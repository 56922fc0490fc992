#include "prediction/transformer/code_history.h"

#include <algorithm>

namespace maq {

void CodeHistory::add(const uint16_t* values, int64_t time_ns) {
  std::copy_n(values, count_, values_.data() + next_ * count_);
  times_ns_[next_] = time_ns;
  next_ = (next_ + 1) % kKept;
  size_ = std::min(size_ + 1, kKept);
}

void CodeHistory::select(int64_t target_ns, size_t wanted, const uint16_t** frames) const {
  std::fill_n(frames, wanted, nullptr);
  if (size_ == 0 || wanted == 0) return;
  frames[wanted - 1] = at(0).values;
  // Times of a stream may have any value but are close together, so doubles hold their differences exactly enough.
  const auto before_newest = [&](size_t age) { return double(uint64_t(newest_ns()) - uint64_t(at(age).time_ns)); };
  const double step = double(uint64_t(target_ns) - uint64_t(newest_ns()));
  size_t age = 0;
  for (size_t k = 1; k < wanted; ++k) {
    const double due = double(k) * step;
    const auto off = [&](size_t of) { return std::abs(before_newest(of) - due); };
    if (++age >= size_) return;
    while (age + 1 < size_ && off(age + 1) < off(age)) ++age;
    if (off(age) > step / 2) return;
    frames[wanted - 1 - k] = at(age).values;
  }
}

}  // namespace maq
