// The files of a field (docs/formats.md).
#pragma once

#include <string>

#include "edges/edge_field.h"

namespace maq {

// Writes <stem>_distance.png (16 bits, thousandths of r), <stem>_kind.png and <stem>_edges.json into an existing
// folder. Each appears atomically, and none before all are written. Throws MAQ_ERROR_UNWRITABLE, and what file_codecs()
// and encode_image() throw.
void write_field_files(const EdgeField& field, const std::string& folder, const std::string& stem);

}  // namespace maq
