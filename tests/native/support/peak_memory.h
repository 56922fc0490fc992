// How much more memory than before some work has at its peak.
#pragma once

#include <fstream>
#include <string>

// In MiB; 0 under sanitizers, which keep what is freed.
template <class Body>
double peak_memory_growth_mib(Body&& body) {
  const auto peak_mib = [] {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;) {
      double kib = 0;
      if (word == "VmHWM:" && status >> kib) return kib / 1024;
    }
    return 0.0;
  };
  std::ofstream("/proc/self/clear_refs") << "5";  // the peak is what it is now
  const double before = peak_mib();
  body();
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return 0 * before;
#else
  return peak_mib() - before;
#endif
}
