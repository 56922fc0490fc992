// Splats from and to files of other programs.
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

// Whether a file of that name holds splats: it ends with .ply, .spz or .glb.
bool is_name_of_splats(const std::string& path);

// Writes the kind of file that the extension tells: .ply as read_splat_ply() reads it, .spz of version 3, or .glb, glTF
// with KHR_gaussian_splatting. Replaces a file of that name atomically. Throws MAQ_ERROR_UNWRITABLE; then an older file
// is as it was. Throws MAQ_ERROR_UNSUPPORTED for coordinates that 24 bits of an SPZ file cannot hold.
void write_splat_file(const Splats& splats, const std::string& path);

// The bytes of such files.
std::vector<uint8_t> spz_of(const Splats& splats);
std::vector<uint8_t> glb_of(const Splats& splats);

}  // namespace maq
