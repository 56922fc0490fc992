// Threads that compute beside one that draws.
#pragma once

#if defined(__linux__)
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#endif

namespace maquette {

// So that drawing goes first; threads that this one starts inherit it.
inline void lower_priority_of_this_thread() {
#if defined(__linux__)
  constexpr int kNice = 5;
  const id_t thread = id_t(syscall(SYS_gettid));
  setpriority(PRIO_PROCESS, thread, std::min(19, getpriority(PRIO_PROCESS, thread) + kNice));
#endif
}

}  // namespace maquette
