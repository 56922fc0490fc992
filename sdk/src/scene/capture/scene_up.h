// Which way is up in a capture.
#pragma once

#include <array>
#include <vector>

namespace maq {

// Returns up, of length 1. People hold cameras level more often than they hold them horizontally. Up is therefore
// perpendicular to the x axes of the cameras, by least squares. If the x axes leave it open (one camera, or all side by
// side), it is as near as possible to the mean of the cameras' up axes. The mean alone is tilted if all cameras look
// down from one side. `rotations` are world to camera, row by row. If the up axes cancel out, up is the first camera's;
// without cameras it is +z.
std::array<double, 3> up_of_cameras(const std::vector<std::array<double, 9>>& rotations);

// `convention`, unless the cameras' own up is over 45 degrees away from it: then that.
std::array<double, 3> up_by_convention(const std::array<double, 3>& convention,
                                       const std::vector<std::array<double, 9>>& rotations);

}  // namespace maq
