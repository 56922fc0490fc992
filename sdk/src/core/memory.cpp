#include "core/memory.h"

#include <sys/mman.h>

#include <array>
#include <cstdlib>

namespace maq {
namespace {

// A larger one, freed, would change from where malloc takes the next ones.
constexpr size_t kMaxHeapBytes = 64 << 10;

}  // namespace

bool says_out_of_memory(std::string_view text) {
  // std::bad_alloc, ONNX Runtime's arena and strerror(ENOMEM), glibc's loader, libjpeg.
  constexpr std::array<std::string_view, 4> kWords = {"bad_alloc", "llocate memory", "ut of memory",
                                                      "nsufficient memory"};
  for (const std::string_view words : kWords) {
    if (text.find(words) != std::string_view::npos) return true;
  }
  return false;
}

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

}  // namespace maq
