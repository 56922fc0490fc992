// The states that a source reports.
#pragma once

#include <algorithm>
#include <mutex>
#include <vector>

#include "maquette/maquette.h"
#include "support/wait_until.h"

// Collects reports, in order.
class Reports {
 public:
  static void note(void* self, maq_source_state state, const char*) {
    auto* reports = static_cast<Reports*>(self);
    std::lock_guard<std::mutex> lock(reports->mutex_);
    reports->states_.push_back(state);
  }
  std::vector<maq_source_state> states() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return states_;
  }
  bool wait_for(maq_source_state state) const {
    return wait_until([&] {
      const auto all = states();
      return std::find(all.begin(), all.end(), state) != all.end();
    });
  }

 private:
  mutable std::mutex mutex_;
  std::vector<maq_source_state> states_;
};
