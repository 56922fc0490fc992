// Points whose look is out of all proportion to that of the others.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/format/fitted_points.h"

namespace maq {

// False where a point is stored without slopes: its look moves by less than that (ModelledPoints::variations), or not at all.
bool look_varies(const ModelledPoints& points, uint32_t index, float least_variation);

// Indices of all points in groups, the ordinary ones first; mostly there is one group. Wild points have a mean (from the
// median) or a slope that is over 32 times as large as 7/8 of their group have it. The steps of a block are as fine as its
// largest number allows, so what they are among would lose its differences; apart, at 8 bits its error is at most a
// fourteenth of them. No group has more points than the one before it, and there are at most four; one
// where numbers are stored without steps.
std::vector<std::vector<uint32_t>> set_wild_apart(const ModelledPoints& points, float least_variation, bool has_steps);

}  // namespace maq
