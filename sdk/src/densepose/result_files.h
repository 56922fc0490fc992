// The files of a dense pose result, in the DensePose convention (docs/reference/formats.md).
#pragma once

#include <string>

#include "densepose/densepose.h"

namespace maq {

// Writes <stem>_IUV.png, <stem>_INDS.png and <stem>.json into an existing folder. Each appears atomically, and none
// before all are written. Throws MAQ_ERROR_UNWRITABLE, and the errors of encode_image().
void write_result_files(const DensePoseResult& result, const std::string& folder, const std::string& stem);

}  // namespace maq
