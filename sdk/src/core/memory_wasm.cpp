#include <cstdint>
#include <cstdlib>
#include <new>

#include "core/memory.h"

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

}  // namespace maq
