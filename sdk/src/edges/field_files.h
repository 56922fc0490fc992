// The files of a field (docs/reference/formats.md).
#pragma once

#include <string>

#include "edges/edge_field.h"

namespace maq {

// Writes <path>_distance.png (16 bits, thousandths of r), <path>_kind.png and <path>_edges.json. Each appears
// atomically, and none before all are written. Throws MAQ_ERROR_UNWRITABLE and the errors of encode_depth_image() and
// encode_image().
void write_field_files(const EdgeField& field, const std::string& path);

}  // namespace maq
