// Splats from files of other programs: 3DGS .ply and .spz.
#pragma once

#include <string>

#include "scene/splats/splats.h"

namespace maq {

// Whether the file begins like a PLY or an SPZ file. Throws the errors of open_file().
bool is_splat_file(const std::string& path);

// Reads either of them by its first bytes. Throws MAQ_ERROR_UNREADABLE for a file that is damaged, truncated, or has no
// splat to show; MAQ_ERROR_UNSUPPORTED for other versions, compressed PLY, PLY of points, and over kMaxPoints; and
// MAQ_ERROR_OUT_OF_MEMORY.
Splats read_splat_file(const std::string& path);

// The vertices of a PLY file as the programs of 3D Gaussian Splatting write them: x, y, z, f_dc_0 to 2, opacity
// (logit), scale_0 to 2 (logarithms; without scale_2 splats are flat), rot_0 to 3 (w, x, y, z), and f_rest_0 to 8, 23
// or 44. Any type, order and form. Splats that are not finite or have no rotation are left out.
Splats read_splat_ply(const std::string& path);

// SPZ by Niantic, versions 2 and 3 (https://github.com/nianticlabs/spz). Positions are not converted. Harmonics
// of degree 4 are skipped.
Splats read_spz(const std::string& path);

}  // namespace maq
