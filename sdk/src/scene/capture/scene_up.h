// Which way is up in a capture.
#pragma once

#include <array>
#include <vector>

namespace maq {

// Of length 1. People hold cameras level more than they hold them horizontally, so up is at right angles to what is to
// the right in the pictures, by least squares; where that leaves it open (one camera, or all side by side) it is as
// near as can be to the mean of what is up in the pictures. That mean alone is tilted when all look down from one side.
// `rotations` are world to camera, row by row. Where the ups cancel out it is that of the first one; without any it is
// +z.
std::array<double, 3> up_of_cameras(const std::vector<std::array<double, 9>>& rotations);

// `convention`, unless the cameras' own up is over 45 degrees away from it: then that.
std::array<double, 3> up_by_convention(const std::array<double, 3>& convention,
                                       const std::vector<std::array<double, 9>>& rotations);

}  // namespace maq
