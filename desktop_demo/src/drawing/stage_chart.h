// Milliseconds of each stage over the last frames, stacked, for the panel.
#pragma once

#include <array>
#include <cstddef>
#include <deque>

class StageChart {
 public:
  using Times = std::array<float, 9>;

  void add(const Times& times_ms);
  void clear() { times_ms_.clear(); }
  // At the cursor of the panel, with a legend. `scale`: of texts and margins.
  void draw(const char* const* names, size_t count, float scale) const;

 private:
  std::deque<Times> times_ms_;
};
