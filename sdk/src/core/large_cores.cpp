#include <sched.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>

#include "core/worker_threads.h"

namespace maq {
namespace {

// A measure of a core's speed. A large core has at least min_fraction of the fastest core's value. Small cores have a
// third of the capacity, but about two thirds of the frequency.
struct Measure {
  const char* file;
  double min_fraction;
};
constexpr Measure kMeasures[] = {{"/cpu_capacity", 0.5}, {"/cpufreq/cpuinfo_max_freq", 0.75}};

// 0 where the file is missing or damaged.
long read_speed(const std::string& path) {
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "re"), &std::fclose);
  long speed = 0;
  return file != nullptr && std::fscanf(file.get(), "%9ld", &speed) == 1 && speed > 0 ? speed : 0;
}

}  // namespace

std::vector<int> allowed_cores() {
  std::vector<int> cores;
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return cores;
  for (int core = 0; core < CPU_SETSIZE; ++core) {
    if (CPU_ISSET(core, &set)) cores.push_back(core);
  }
  return cores;
}

int count_large_cores(const std::vector<int>& allowed, const std::string& folder) {
  for (const Measure& measure : kMeasures) {
    std::vector<long> speeds;
    for (const int core : allowed) {
      speeds.push_back(read_speed(folder + "/cpu" + std::to_string(core) + measure.file));
      if (speeds.back() == 0) break;
    }
    if (speeds.empty() || speeds.back() == 0) continue;
    const double limit = measure.min_fraction * double(*std::max_element(speeds.begin(), speeds.end()));
    return int(std::count_if(speeds.begin(), speeds.end(), [=](long speed) { return double(speed) >= limit; }));
  }
  return int(allowed.size());
}

}  // namespace maq
