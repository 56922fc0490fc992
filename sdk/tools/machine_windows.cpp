#include "machine.h"

#include <windows.h>
// Needs what windows.h declares.
#include <psapi.h>

namespace {

struct ProcessTimes {
  double start_s = 0, kernel_s = 0, user_s = 0;
};

double seconds(const FILETIME& time) { return 1e-7 * double(uint64_t(time.dwHighDateTime) << 32 | time.dwLowDateTime); }

ProcessTimes process_times() {
  FILETIME start{}, end{}, kernel{}, user{};
  if (::GetProcessTimes(::GetCurrentProcess(), &start, &end, &kernel, &user) == 0) return {};
  return {seconds(start), seconds(kernel), seconds(user)};
}

}  // namespace

// `maquette bench` alone needs the other functions of the header; it is not there on Windows.
double own_processor_seconds() {
  const ProcessTimes times = process_times();
  return times.kernel_s + times.user_s;
}

double seconds_since_start() {
  FILETIME now{};
  ::GetSystemTimeAsFileTime(&now);
  return seconds(now) - process_times().start_s;
}

int64_t peak_memory_bytes() {
  PROCESS_MEMORY_COUNTERS counters{};
  if (::K32GetProcessMemoryInfo(::GetCurrentProcess(), &counters, sizeof counters) == 0) return 0;
  return int64_t(counters.PeakWorkingSetSize);
}
