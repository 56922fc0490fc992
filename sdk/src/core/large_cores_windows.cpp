#include <windows.h>

#include "core/worker_threads.h"

namespace maq {

// Windows tells of one group of processors, the first of the process: 64 cores at most.
std::vector<int> allowed_cores() {
  std::vector<int> cores;
  DWORD_PTR allowed = 0, all = 0;
  if (::GetProcessAffinityMask(::GetCurrentProcess(), &allowed, &all) == 0) return cores;
  for (int core = 0; core < 64; ++core) {
    if ((allowed >> core & 1) != 0) cores.push_back(core);
  }
  return cores;
}

// Windows does not tell how large they are.
int count_large_cores(const std::vector<int>& allowed, const std::string&) { return int(allowed.size()); }

}  // namespace maq
