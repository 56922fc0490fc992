// The sprite sheet that CMake puts into the library (cmake/EmbedFile.cmake).
#pragma once

#include <cstddef>
#include <cstdint>

namespace maq {

struct EmbeddedFile {
  const uint8_t* bytes = nullptr;
  size_t size_bytes = 0;  // 0: this build has none
};

EmbeddedFile stub_people_sheet();

}  // namespace maq
