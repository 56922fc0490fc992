// Files of depth to depth frames, and back.
#pragma once

#include <string>

#include "core/frame.h"

namespace maq {

// Reads a grey PNG or TIFF image of 16 bits, or a grey TIFF image of floats, into `frame`: as DEPTH16 where 16 bits
// count millimetres (a unit of 0.001), otherwise as DEPTH32F, 0 where nothing is known. `unit_m`: metres of a stored 1.
// Throws MAQ_ERROR_UNSUPPORTED for an image of other pixels or another format, and the errors of read_image_file().
void read_depth_file(const std::string& path, double unit_m, Frame& frame);

// By the extension of `path`: .png has whole millimetres in 16 bits, 0 where nothing is known and over 65.534 m; .tif
// and .tiff have metres as floats. Written atomically. Throws MAQ_ERROR_INVALID_ARGUMENT for another extension,
// MAQ_ERROR_UNWRITABLE, and the errors of encode_depth_image().
void write_depth_file(const ImageView& depth, const std::string& path);

}  // namespace maq
