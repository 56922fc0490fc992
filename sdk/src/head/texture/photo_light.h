// The effect of a photo's exposure, white balance and light on a surface's colours: fitted where the photo shows the
// surface, applied elsewhere.
#pragma once

#include <array>
#include <vector>

#include "core/math/vec3.h"

namespace maq::head {

// One colour channel, 0 to 255: gain * own + offset + own * dot(directed, normal), a Lambertian surface in uniform
// light and light from one side.
struct ChannelLight {
  double gain = 1, offset = 0;
  Vec3 directed;

  float operator()(float own, const float* normal) const;  // within 0 to 255
  double strength(const float* normal) const;              // factor of own colours

  // The colour `seen` if the light had the strength `even` everywhere; within 0 to 255. Where hardly any light falls,
  // the strength is unknown and counts as `darkest` of `even`.
  float evened(float seen, const float* normal, double even, double darkest) const;
};

using PhotoLight = std::array<ChannelLight, 3>;

// By weighted least squares, over points of a surface: `weights` [n], 0 where the photo does not see it; `own` colours,
// `differences` of the photo's from them, and unit `normals` [n][3]. Undetermined parameters stay near a plain gain:
// nearly equal colours cannot separate gain and offset, and few normals give no direction. Nothing seen: nothing is
// changed.
PhotoLight fit_photo_light(const std::vector<float>& weights, const std::vector<float>& own,
                           const std::vector<float>& differences, const std::vector<float>& normals);

}  // namespace maq::head
