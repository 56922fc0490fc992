// What this process takes of the machine, for a panel.
#pragma once

#include <chrono>

namespace maquette {

class ProcessLoad {
 public:
  // Measures at most once a second; the first time a second after this was made.
  void update();
  double cpu_percent() const { return cpu_percent_; }  // of one core, over the last second
  double memory_mb() const { return memory_mb_; }      // resident; 0 until measured

 private:
  static double cpu_s();  // user and system, of all threads

  std::chrono::steady_clock::time_point measured_at_ = std::chrono::steady_clock::now();
  double cpu_s_ = cpu_s(), cpu_percent_ = 0, memory_mb_ = 0;
};

}  // namespace maquette
