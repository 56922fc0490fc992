#include "pipeline/thread_priority.h"

#include <windows.h>

namespace maq {

void lower_priority_of_this_thread(int nice) {
  if (nice == 0) return;
  const int priority = nice < 10 ? THREAD_PRIORITY_BELOW_NORMAL : THREAD_PRIORITY_LOWEST;
  ::SetThreadPriority(::GetCurrentThread(), priority);
}

}  // namespace maq
