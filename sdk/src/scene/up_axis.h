// Which way is up in a captured place.
#pragma once

#include <array>
#include <vector>

namespace maq {

// The mean of the directions that are up in the pictures, of length 1: people hold cameras upright and tilt them in all
// directions alike. `rotations` are world to camera, row by row. Where they cancel out it is that of the first one;
// without any it is +z.
std::array<double, 3> up_of_cameras(const std::vector<std::array<double, 9>>& rotations);

// `convention`, unless the cameras' own up is over 45 degrees away from it: then that.
std::array<double, 3> up_by_convention(const std::array<double, 3>& convention,
                                       const std::vector<std::array<double, 9>>& rotations);

}  // namespace maq
