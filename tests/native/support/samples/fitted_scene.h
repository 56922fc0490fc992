// Synthetic fitted points: a ball over a floor, smooth colours, linear terms of which many are small.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "scene/format/fitted_points.h"
#include "scene/format/scene.h"

inline maq::FittedPoints ball_over_a_floor(size_t count, uint32_t seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform(-1, 1);
  maq::FittedPoints points;
  points.origin = {12.5, -3, 100};
  points.up = {0, 0, 1};
  for (size_t i = 0; i < count; ++i) {
    float at[3] = {uniform(random), uniform(random), -1};
    if (i % 2 == 0) {
      for (float& value : at) value = normal(random);
      const float length = std::sqrt(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]) + 1e-6f;
      for (float& value : at) value /= length;
    }
    points.x.push_back(at[0]);
    points.y.push_back(at[1]);
    points.z.push_back(at[2]);
    for (int c = 0; c < maq::kFeatures; ++c) {
      points.constant_terms.push_back(0.5f + 0.3f * std::sin(3 * at[c % 3] + float(c)) + 0.02f * normal(random));
    }
    const float strength = 0.02f * std::abs(normal(random));
    for (size_t k = 0; k < maq::kLinearTerms; ++k) points.linear_terms.push_back(strength * normal(random));
    points.view_dependence.push_back(7 * strength);  // about as long as all its linear_terms together
    points.views.push_back(uint32_t(1 + i % 9));
  }
  return points;
}
