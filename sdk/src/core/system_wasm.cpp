// Memory, cores and files, in WebAssembly.
#include <pthread.h>

#include <cstdint>
#include <cstdlib>
#include <new>

#include "core/memory.h"
#include "core/module.h"
#include "core/worker_threads.h"

// Emscripten declares it, but does not have it.
extern "C" int pthread_setname_np(pthread_t, const char*) { return 0; }

namespace maq {

bool has_memory(size_t bytes) {
  void* volatile memory = std::malloc(bytes);  // volatile: else the compiler takes its success for granted
  const bool is_there = memory != nullptr;
  std::free(memory);
  return is_there;
}

void require_memory(size_t bytes) {
  if (!has_memory(bytes)) throw std::bad_alloc();
}

size_t address_space_left() { return SIZE_MAX; }

// JavaScript tells how many threads there are.
std::vector<int> allowed_cores() { return {0}; }
int count_large_cores(const std::vector<int>& allowed, const std::string&) { return int(allowed.size()); }

// There are no files: bundles come from memory.
std::string library_folder() { return ""; }
std::string find_shared_file(const std::string&) { return ""; }

}  // namespace maq
