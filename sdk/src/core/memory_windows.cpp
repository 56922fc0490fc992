#include "core/memory.h"

#include <windows.h>

#include <cstdint>
#include <new>

namespace maq {

bool has_memory(size_t bytes) {
  void* const memory = ::VirtualAlloc(nullptr, bytes, MEM_RESERVE | MEM_COMMIT, PAGE_READWRITE);
  if (memory == nullptr) return false;
  ::VirtualFree(memory, 0, MEM_RELEASE);
  return true;
}

void require_memory(size_t bytes) {
  if (!has_memory(bytes)) throw std::bad_alloc();
}

size_t address_space_left() { return SIZE_MAX; }

}  // namespace maq
