// Waiting for an event on a machine that may be busy: the limit is for a defect, not for speed.
#pragma once

#include <chrono>
#include <cstdint>
#include <thread>

constexpr int64_t kSecond = 1000000000;
constexpr int64_t kLimit = 60 * kSecond;

// False when `happened` is not true within the limit.
template <class Condition>
bool wait_until(Condition&& happened, std::chrono::seconds limit = std::chrono::seconds(60)) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!happened()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}
