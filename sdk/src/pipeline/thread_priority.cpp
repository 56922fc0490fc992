#include "pipeline/thread_priority.h"

#if defined(__linux__)
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

#include <algorithm>

namespace maq {

void lower_priority_of_this_thread(int nice) {
#if defined(__linux__)
  if (nice == 0) return;
  const id_t thread = id_t(syscall(SYS_gettid));
  setpriority(PRIO_PROCESS, thread, std::min(19, getpriority(PRIO_PROCESS, thread) + nice));
#else
  (void)nice;
#endif
}

}  // namespace maq
