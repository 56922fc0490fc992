// The sprite sheet of stub:people, from the two files that CMake puts into the library (cmake/EmbedFile.cmake).
#pragma once

#include <cstddef>
#include <cstdint>

#include "image/sprite.h"

namespace maq {

struct EmbeddedFile {
  const uint8_t* bytes = nullptr;
  size_t size_bytes = 0;  // 0: this build has none
};
EmbeddedFile stub_people_colours();
EmbeddedFile stub_people_mask();

// `colours`: a JPEG image. `mask`: its alpha, as export/people/sprite_files.py codes it. Throws MAQ_ERROR_UNREADABLE.
BgraImage decode_people_sheet(const EmbeddedFile& colours, const EmbeddedFile& mask);

}  // namespace maq
