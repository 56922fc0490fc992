// People of a stream who were shown in the previous frame stay with lower scores, so that nobody comes and goes with
// the noise of the scores.
#pragma once

#include <vector>

#include "densepose/detector/box.h"
#include "image/crop_input.h"

namespace maq {

// The score above which a person who was shown stays; new people need `threshold`.
float kept_score(float threshold);

// Marks in `found`, best first, the boxes of people who were shown: each box of `shown`, in pixels of the image,
// belongs to the first of `found` that lies on it. Drops the other boxes with scores up to `threshold`. `to_image` maps
// pixels of the network's input.
void mark_shown(const std::vector<Box>& shown, const AffineMap& to_image, float threshold,
                std::vector<ScoredBox>& found);

}  // namespace maq
