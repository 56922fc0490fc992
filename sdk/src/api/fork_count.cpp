#include <pthread.h>

#include <atomic>
#include <new>

#include "api/handle_state.h"

namespace maq {
namespace {

std::atomic<uint32_t> forks{0};

}  // namespace

uint32_t fork_count() {
  // Numbers of processes do not tell: in a new namespace the child may have its parent's.
  static const bool is_registered = [] {
    if (pthread_atfork(nullptr, nullptr, [] { ++forks; }) != 0) throw std::bad_alloc();
    return true;
  }();
  return is_registered ? forks.load(std::memory_order_relaxed) : 0;
}

}  // namespace maq
