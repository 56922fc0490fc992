// The basis network against its formula in double.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "scene/networks/view_basis.h"

namespace {

using maq::kBasis;
using maq::ViewBasis;

std::vector<double> reference(const std::vector<float>& weights, const double (&direction)[3]) {
  std::vector<double> values;
  for (const double frequency : {M_PI / 2, M_PI, 2 * M_PI}) {
    for (const double x : direction) values.push_back(std::sin(frequency * x));
    for (const double x : direction) values.push_back(std::cos(frequency * x));
  }
  const float* weight = weights.data();
  for (const size_t outputs : {16, 16, 6}) {
    const float* bias = weight + outputs * values.size();
    std::vector<double> next;
    for (size_t o = 0; o < outputs; ++o) {
      double sum = bias[o];
      for (size_t k = 0; k < values.size(); ++k) sum += double(weight[o * values.size() + k]) * values[k];
      next.push_back(outputs == 6 || sum > 0 ? sum : 0.01 * sum);
    }
    weight = bias + outputs;
    values = next;
  }
  EXPECT_EQ(weight, weights.data() + weights.size());
  return values;
}

TEST(ViewBasis, IsItsFormulaInEveryDirectionAndAnyNumberOfThem) {
  EXPECT_EQ(ViewBasis::kWeights, 678u);
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  std::vector<float> weights(ViewBasis::kWeights);
  for (float& weight : weights) weight = 0.5f * normal(random);
  const ViewBasis basis(weights);
  for (const size_t count : {1u, 63u, 64u, 65u, 1000u}) {
    std::vector<float> x(count), y(count), z(count), values(count * kBasis, -1);
    for (size_t i = 0; i < count; ++i) {
      float a = normal(random), b = normal(random), c = normal(random);
      if (i < 6) a = b = c = 0, (i < 2 ? a : i < 4 ? b : c) = i % 2 == 0 ? 1.0f : -1.0f;  // along the axes
      const float length = std::sqrt(a * a + b * b + c * c);
      x[i] = a / length, y[i] = b / length, z[i] = c / length;
    }
    basis.evaluate(x.data(), y.data(), z.data(), count, values.data());
    for (size_t i = 0; i < count; ++i) {
      const std::vector<double> expected = reference(weights, {x[i], y[i], z[i]});
      for (size_t k = 0; k < size_t(kBasis); ++k) EXPECT_NEAR(values[k * count + i], expected[k], 2e-5) << i;
    }
  }
}

TEST(ViewBasis, NoDirectionIsOneTooForAPointInTheCamerasCentre) {
  std::vector<float> weights(ViewBasis::kWeights, 0.1f);
  const float zero = 0;
  float values[kBasis];
  ViewBasis(weights).evaluate(&zero, &zero, &zero, 1, values);
  EXPECT_NEAR(values[0], reference(weights, {0, 0, 0})[0], 1e-5);
}

}  // namespace
