// Opacity along rays and its derivatives, against the same in long double, and the paper's form beside it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "head/fit/opacity.h"

namespace {

using maq::head::MatteTerm;
using maq::head::RayOpacity;

const double kSharpness[] = {1, 10, 64, 1e3, 1e4, 1e5};
const size_t kSections[] = {1, 12, 4096};

struct Ray {
  std::string name;
  std::vector<float> distances;
};

// Rays of 4 dm through slabs and spheres, in sections of the same length.
std::vector<Ray> rays_of(size_t sections) {
  std::vector<Ray> rays;
  const auto add = [&](const char* name, auto distance) {
    Ray ray{name, {}};
    for (size_t i = 0; i <= sections; ++i) ray.distances.push_back(float(distance(4.0 * double(i) / double(sections))));
    rays.push_back(std::move(ray));
  };
  add("hits a sphere", [](double t) { return std::abs(t - 2) - 1; });
  add("falls through a plane", [](double t) { return 2 - t; });
  add("tangent to a sphere", [](double t) { return std::sqrt((t - 2) * (t - 2) + 1) - 1; });
  add("inside from the start", [](double t) { return std::abs(t - 1) - 1.5; });
  add("deep inside", [](double t) { return -1.999 - 0.0002 * t; });
  add("misses", [](double t) { return std::sqrt((t - 2) * (t - 2) + 1.44) - 1; });
  add("misses from afar", [](double t) { return 2 - 0.1 * t; });
  add("passes two surfaces", [](double t) { return std::min(std::abs(t - 1) - 0.3, std::abs(t - 3) - 0.02); });
  add("of no length", [](double) { return 0.001; });
  add("comes out", [](double t) { return t - 2; });
  return rays;
}

// log sigmoid(x) without a difference.
long double log_sigmoid(long double x) { return x > 0 ? -std::log1p(std::exp(-x)) : x - std::log1p(std::exp(x)); }

struct Reference {
  std::vector<long double> weights;
  long double log_transmittance = 0;
};

Reference reference_of(const std::vector<long double>& f, long double s) {
  Reference found;
  for (size_t i = 0; i + 1 < f.size(); ++i) {
    const long double log_clear = std::min(0.0L, log_sigmoid(s * f[i + 1]) - log_sigmoid(s * f[i]));
    found.weights.push_back(-std::exp(found.log_transmittance) * std::expm1(log_clear));
    found.log_transmittance += log_clear;
  }
  return found;
}

float paper_sigmoid(float x) { return 1 / (1 + std::exp(-x)); }

// The transmittance as NeuS computes it, in float32.
float paper_transmittance(const std::vector<float>& f, float s) {
  float transmittance = 1;
  for (size_t i = 0; i + 1 < f.size(); ++i) {
    const float before = paper_sigmoid(s * f[i]), after = paper_sigmoid(s * f[i + 1]);
    const float alpha = std::min(1.0F, std::max(0.0F, (before - after + 1e-5F) / (before + 1e-5F)));
    transmittance *= 1 - alpha + 1e-7F;
  }
  return transmittance;
}

TEST(Opacity, TransmittanceAndWeightsAreThoseOfLongDoubleAndThePapersFormIsNot) {
  RayOpacity ray_opacity;
  double paper_worst = 0, paper_misses = 0;
  for (const size_t sections : kSections) {
    for (const Ray& ray : rays_of(sections)) {
      double worst = 0;
      std::string paper;
      for (const double s : kSharpness) {
        ray_opacity.run(ray.distances.data(), sections, s);
        const Reference reference = reference_of({ray.distances.begin(), ray.distances.end()}, s);
        const double expected = double(std::exp(reference.log_transmittance));
        worst = std::max(worst, std::abs(1 - ray_opacity.opacity() - expected));
        EXPECT_NEAR(ray_opacity.log_transmittance(), double(reference.log_transmittance),
                    1e-6 * std::abs(double(reference.log_transmittance)) + 1e-40)
            << ray.name;
        for (size_t i = 0; i < sections; ++i) {
          ASSERT_NEAR(ray_opacity.weights()[i], double(reference.weights[i]), 1e-7) << ray.name << " " << s << " " << i;
        }
        const double off = std::abs(double(paper_transmittance(ray.distances, float(s))) - expected);
        char column[32];
        std::snprintf(column, sizeof(column), " %.0e |", off);
        paper += column;
        if (sections == 12 && s <= 64) paper_worst = std::max(paper_worst, off);
        if (sections == 12 && ray.name == "misses from afar") paper_misses = std::max(paper_misses, off);
      }
      EXPECT_LT(worst, 1e-6) << ray.name;
      if (sections == 12) {
        std::printf("| %s | %.0e |%s\n", ray.name.c_str(), worst, paper.c_str());
      }
    }
  }
  EXPECT_GT(paper_worst, 3e-4);
  EXPECT_GT(paper_misses, 5e-5);
}

TEST(Opacity, DerivativesAreThoseOfLongDouble) {
  RayOpacity ray_opacity;
  for (const size_t sections : kSections) {
    for (const Ray& ray : rays_of(sections)) {
      for (const double s : kSharpness) {
        // A loss that names each weight, each channel and the transmittance.
        std::vector<float> colours(3 * sections), by_colours(3 * sections), by_weights(sections), by_f(sections + 1);
        for (size_t i = 0; i < colours.size(); ++i) colours[i] = float(0.5 + 0.5 * std::sin(double(i) * 0.7));
        const std::array<float, 3> by_colour = {0.7F, -1.1F, 0.4F};
        for (size_t i = 0; i < sections; ++i) by_weights[i] = float(std::cos(double(i)));
        const std::vector<float> own = by_weights;
        const auto loss_of = [&](const std::vector<long double>& f, long double sharpness) {
          const Reference reference = reference_of(f, sharpness);
          long double loss = 0.3L * std::exp(reference.log_transmittance);
          for (size_t i = 0; i < sections; ++i) {
            long double by_weight = own[i];
            for (size_t c = 0; c < 3; ++c) by_weight += static_cast<long double>(by_colour[c]) * colours[3 * i + c];
            loss += by_weight * reference.weights[i];
          }
          return loss;
        };
        ray_opacity.run(ray.distances.data(), sections, s);
        maq::head::blend_colours_back(ray_opacity.weights(), colours.data(), by_colour, by_colours.data(),
                                      by_weights.data());
        double by_s = 0;
        ray_opacity.back(by_weights.data(), 0.3 * std::exp(ray_opacity.log_transmittance()), by_f.data(), by_s);
        std::vector<long double> f(ray.distances.begin(), ray.distances.end());
        const long double step = 1e-9L / s;
        std::vector<double> expected(sections + 1);
        double largest = 0;
        const size_t stride = sections > 100 ? 811 : 1;
        for (size_t i = 0; i <= sections; i += stride) {
          const long double middle = f[i];
          f[i] = middle + step;
          const long double up = loss_of(f, s);
          f[i] = middle - step;
          expected[i] = double((up - loss_of(f, s)) / (2 * step));
          f[i] = middle;
          largest = std::max(largest, std::abs(expected[i]));
        }
        for (size_t i = 0; i <= sections; i += stride) {
          ASSERT_TRUE(std::isfinite(by_f[i]));
          const bool is_kink = (i > 0 && f[i - 1] == f[i]) || (i < sections && f[i + 1] == f[i]);
          if (is_kink) continue;  // no derivative where a section has no slope
          EXPECT_NEAR(by_f[i], expected[i], 1e-4 * largest + 1e-9 * s)
              << ray.name << " " << sections << " " << s << " " << i;
        }
        const long double change = 1e-6L * s;
        const double expected_s = double((loss_of(f, s + change) - loss_of(f, s - change)) / (2 * change));
        EXPECT_NEAR(by_s, expected_s, 1e-4 * std::abs(expected_s) + 1e-9) << ray.name << " " << sections << " " << s;
        for (size_t i = 0; i < sections; i += stride) {
          EXPECT_NEAR(by_colours[3 * i + 1], ray_opacity.weights()[i] * by_colour[1], 1e-7);
        }
      }
    }
  }
}

TEST(Opacity, AlphaOfExactlyZeroAndOne) {
  RayOpacity ray;
  const float wall[4] = {2, 2, -2, -2}, ones[3] = {1, 1, 1};
  float by_f[4];
  double by_s = 0;
  ray.run(wall, 3, 1e5);
  EXPECT_EQ(ray.weights(), (std::vector<float>{0, 1, 0}));
  EXPECT_EQ(ray.opacity(), 1);
  ray.back(ones, 1, by_f, by_s);
  for (const float value : by_f) EXPECT_TRUE(std::isfinite(value));
  const float rising[3] = {-1, -0.5F, 0.5F};
  ray.run(rising, 2, 64);
  EXPECT_EQ(ray.weights(), (std::vector<float>{0, 0}));
  EXPECT_EQ(ray.opacity(), 0);
  ray.run(wall, 0, 64);  // no section at all
  EXPECT_EQ(ray.opacity(), 0);
}

TEST(Opacity, ARayFarOutsideIsClearWithoutWork) {
  RayOpacity ray;
  const float far[4] = {2, 1.5F, 1.2F, 1.8F}, ones[3] = {1, 1, 1};
  ray.run(far, 3, 100);
  EXPECT_TRUE(ray.is_clear());
  EXPECT_EQ(ray.log_transmittance(), 0);
  float by_f[4] = {9, 9, 9, 9};
  double by_s = 0;
  ray.back(ones, 1, by_f, by_s);
  for (const float value : by_f) EXPECT_EQ(value, 0);
  EXPECT_EQ(by_s, 0);
  ray.run(far, 3, 64);
  EXPECT_FALSE(ray.is_clear());
  EXPECT_LT(ray.log_transmittance(), 0);
}

TEST(Opacity, DistancesThatAreNotFiniteLeaveTheirSectionsClear) {
  RayOpacity ray;
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  const float distances[8] = {1, nan, 1, infinite, 0.5F, -infinite, 0.1F, -0.1F}, ones[7] = {1, 1, 1, 1, 1, 1, 1};
  for (const double s : kSharpness) {
    ray.run(distances, 7, s);
    float by_f[8];
    double by_s = 0;
    ray.back(ones, 1, by_f, by_s);
    EXPECT_FALSE(std::isnan(ray.log_transmittance()));
    for (const float weight : ray.weights()) EXPECT_TRUE(weight >= 0 && weight <= 1);
    for (const float value : by_f) EXPECT_TRUE(std::isfinite(value)) << s;
    EXPECT_TRUE(std::isfinite(by_s)) << s;
  }
}

TEST(Opacity, ColoursAreBlendedByWeight) {
  const std::vector<float> weights = {0.25F, 0.5F};
  const float colours[6] = {1, 0, 0.5F, 0, 1, 0.5F};
  const std::array<float, 3> colour = maq::head::blend_colours(weights, colours);
  EXPECT_FLOAT_EQ(colour[0], 0.25F);
  EXPECT_FLOAT_EQ(colour[1], 0.5F);
  EXPECT_FLOAT_EQ(colour[2], 0.375F);
}

TEST(Opacity, TheMattesCrossEntropyIsFiniteAndSaysWhereItIsClamped) {
  for (const double matte : {0.0, 0.3, 1.0}) {
    for (const double clear : {-1e-30, -1e-12, -1e-3, -0.5, -0.9, -5.0, -50.0, -99.0}) {
      const MatteTerm term = maq::head::matte_cross_entropy(clear, matte);
      const long double opacity = -std::expm1(static_cast<long double>(clear));
      const double expected = double(-matte * std::log(opacity) - (1 - static_cast<long double>(matte)) * clear);
      EXPECT_NEAR(term.loss, expected, 1e-12 * expected + 1e-18);
      EXPECT_FALSE(term.is_clamped);
      const double step = 1e-5 * -clear;
      const double slope = (maq::head::matte_cross_entropy(clear + step, matte).loss -
                            maq::head::matte_cross_entropy(clear - step, matte).loss) /
                           (2 * step);
      EXPECT_NEAR(term.by_log_transmittance, slope, 1e-5 * std::abs(slope) + 1e-8) << matte << " " << clear;
    }
  }
  const MatteTerm hidden = maq::head::matte_cross_entropy(-4e5, 0), missed = maq::head::matte_cross_entropy(0, 1);
  for (const MatteTerm& term : {hidden, missed}) {
    EXPECT_EQ(term.loss, 100);
    EXPECT_EQ(term.by_log_transmittance, 0);
    EXPECT_TRUE(term.is_clamped);
  }
  const MatteTerm right = maq::head::matte_cross_entropy(-4e5, 1), clear = maq::head::matte_cross_entropy(0, 0);
  EXPECT_EQ(right.loss, 0);
  EXPECT_EQ(clear.loss, 0);
  EXPECT_FALSE(right.is_clamped || clear.is_clamped);
  EXPECT_TRUE(maq::head::matte_cross_entropy(-1, std::nan("")).is_clamped);
  EXPECT_EQ(maq::head::matte_cross_entropy(-1, std::nan("")).loss, 0);
}

}  // namespace
