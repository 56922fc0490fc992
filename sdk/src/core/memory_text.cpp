#include <array>

#include "core/memory.h"

namespace maq {

bool says_out_of_memory(std::string_view text) {
  // std::bad_alloc, ONNX Runtime's arena and strerror(ENOMEM), glibc's loader, libjpeg.
  constexpr std::array<std::string_view, 5> kWords = {"bad_alloc", "llocate memory", "emory alloc", "ut of memory",
                                                      "nsufficient memory"};
  for (const std::string_view words : kWords) {
    if (text.find(words) != std::string_view::npos) return true;
  }
  return false;
}

}  // namespace maq
