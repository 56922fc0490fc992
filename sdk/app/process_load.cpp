#include "app/process_load.h"

#include <sys/resource.h>
#include <unistd.h>
#include <fstream>

namespace maquette {

double ProcessLoad::cpu_s() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& time) { return double(time.tv_sec) + double(time.tv_usec) * 1e-6; };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

void ProcessLoad::update() {
  const auto now = std::chrono::steady_clock::now();
  const double passed_s = std::chrono::duration<double>(now - measured_at_).count(), used_s = cpu_s();
  if (passed_s < 1) return;
  cpu_percent_ = 100 * (used_s - cpu_s_) / passed_s;
  measured_at_ = now, cpu_s_ = used_s;
  long pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  memory_mb_ = double(resident) * double(sysconf(_SC_PAGESIZE)) / 1e6;
}

}  // namespace maquette
