// The template head laid onto a fitted one: each of its points on the surface goes where the field has that point.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "head/head_template.h"

namespace maq::head {

// Writes values[10][count] of the field: distance, its gradient (x, y, z), template point (x, y, z), colour (R, G, B,
// logits).
using RegistrationField =
    std::function<void(const float* x, const float* y, const float* z, float* values, size_t count)>;
inline constexpr size_t kRegistrationValues = 10;

struct TemplateRegistration {
  std::vector<float> points;   // [points of the template][3], dm, in the head's frame; finite
  std::vector<float> colours;  // [points][3]: of the field, logits
  // [points][3], dm: the field's template point at each point on the surface, where it is near the wanted one; else the
  // wanted one.
  std::vector<float> template_points;
  double scale = 1;  // of the face by the template's: how much larger actions move
  // For the points on the surface, in dm: distances from the surface, and residuals between the field's template point
  // there and the wanted one.
  double mean_distance = 0, max_distance = 0, mean_residual = 0, max_residual = 0;
  size_t flipped = 0;  // triangles between such points that face away from where they do on the template
};

// `starts`: about where each point of the template lies on the head, [points][3]. `head` has no fault. From there
// points of the surface go along the gradient to distance 0 and across it by the residual of their template point. The
// mean displacement of their neighbours holds them together, less and less. Where the field is no number, or has the
// point nowhere near, and where triangles would flip, the neighbours decide, as they do for skin inside (harmonic
// displacement); eyeballs, teeth and tongue keep their form. The same for any number of threads of `field`.
TemplateRegistration register_template(const HeadTemplate& head, const std::vector<float>& starts,
                                       const RegistrationField& field);

}  // namespace maq::head
