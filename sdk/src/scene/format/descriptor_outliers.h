// Finds points with descriptors far outside of the range of other points.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/format/fitted_points.h"

namespace maq {

// False where a point is stored without linear terms: its view-dependence is below that (FittedPoints), or the terms
// are 0.
bool is_view_dependent(const FittedPoints& points, uint32_t index, float min_view_dependence);

// Indices of all points in groups, inliers first; mostly there is one group. Outliers have a constant term (from the
// median) or a linear term over 32 times as large as 7/8 of their group have. The steps of a block are as fine as its
// largest number allows, so that among others an outlier would cost them their differences; apart, at 8 bits, their
// error is at most a fourteenth of them. No group has more points than the one before it, and there are at most four;
// one where numbers are stored without steps.
std::vector<std::vector<uint32_t>> separate_outliers(const FittedPoints& points, float min_view_dependence,
                                                     bool has_steps);

}  // namespace maq
