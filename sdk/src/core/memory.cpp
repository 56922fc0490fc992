#include "core/memory.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>

namespace maq {
namespace {

// A larger one, freed, would change from where malloc takes the next ones.
constexpr size_t kMaxHeapBytes = 64 << 10;

}  // namespace

bool has_memory(size_t bytes) {
  if (bytes <= kMaxHeapBytes) {
    void* volatile memory = std::malloc(bytes);  // volatile: else the compiler takes its success for granted
    const bool is_there = memory != nullptr;
    std::free(memory);
    return is_there;
  }
  void* const memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return false;
  ::munmap(memory, bytes);
  return true;
}

void require_memory(size_t bytes) {
  if (!has_memory(bytes) || !has_memory(std::min(bytes, kMaxHeapBytes))) throw std::bad_alloc();
}

size_t address_space_left() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return SIZE_MAX;
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen("/proc/self/statm", "re"), &std::fclose);
  unsigned long long pages = 0;
  if (file == nullptr || std::fscanf(file.get(), "%llu", &pages) != 1) return 0;
  const rlim_t taken = rlim_t(pages) * rlim_t(sysconf(_SC_PAGESIZE));
  return taken < limit.rlim_cur ? size_t(limit.rlim_cur - taken) : 0;
}

}  // namespace maq
