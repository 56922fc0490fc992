// The panel at the right, with the common parts of all views, and the help.
#pragma once

#include <sys/resource.h>
#include <unistd.h>
#include <chrono>
#include <fstream>

#include "main_view.h"
#include "screen/window.h"

// The CPU time and memory that this process uses, for a panel.
class ProcessLoad {
 public:
  // Measures at most once a second; the first time a second after this was made.
  void update() {
    const auto now = std::chrono::steady_clock::now();
    const double passed_s = std::chrono::duration<double>(now - measured_at_).count(), used_s = cpu_s();
    if (passed_s < 1) return;
    cpu_percent_ = 100 * (used_s - cpu_s_) / passed_s;
    measured_at_ = now, cpu_s_ = used_s;
    long pages = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> pages >> resident;
    memory_mb_ = double(resident) * double(sysconf(_SC_PAGESIZE)) / 1e6;
  }
  double cpu_percent() const { return cpu_percent_; }  // of one core, over the last second
  double memory_mb() const { return memory_mb_; }      // resident; 0 until measured

 private:
  // User and system, of all threads.
  static double cpu_s() {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    const auto seconds = [](const timeval& time) { return double(time.tv_sec) + double(time.tv_usec) * 1e-6; };
    return seconds(used.ru_utime) + seconds(used.ru_stime);
  }

  std::chrono::steady_clock::time_point measured_at_ = std::chrono::steady_clock::now();
  double cpu_s_ = cpu_s(), cpu_percent_ = 0, memory_mb_ = 0;
};

class Panel {
 public:
  explicit Panel(const Window& window) : window_(window) {}

  Action draw(const Rect& rect, MainView& view, bool has_clip);
  void draw_help(bool* is_open) const;

 private:
  void draw_load();

  const Window& window_;
  ProcessLoad load_;
};
