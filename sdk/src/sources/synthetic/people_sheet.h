// The sprite sheet of stub:people: two files in share/maquette/stub, which the command line and the tests have. Apps
// need not carry them.
#pragma once

#include <cstdint>
#include <vector>

#include "image/sprite.h"

namespace maq {

// Decodes the sheet. `colours`: a JPEG image. `mask`: its alpha, coded by export/people/sprite_files.py.
// Throws MAQ_ERROR_UNREADABLE.
BgraImage decode_people_sheet(const std::vector<uint8_t>& colours, const std::vector<uint8_t>& mask);

// Reads and decodes the installed sheet. Throws MAQ_ERROR_NOT_FOUND where its files are not installed.
BgraImage read_people_sheet();

}  // namespace maq
