// Opacity along rays and its derivatives, against the same in long double, and the paper's form beside it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "head/fit/opacity.h"

namespace {

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

long double log_transmittance_of(const std::vector<long double>& f, long double s) {
  long double sum = 0;
  for (size_t i = 0; i + 1 < f.size(); ++i) sum += std::min(0.0L, log_sigmoid(s * f[i + 1]) - log_sigmoid(s * f[i]));
  return sum;
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

TEST(Opacity, TheTransmittanceIsThatOfLongDoubleAndThePapersFormIsNot) {
  RayOpacity ray_opacity;
  double paper_worst = 0, paper_misses = 0;
  for (const size_t sections : kSections) {
    for (const Ray& ray : rays_of(sections)) {
      double worst = 0;
      std::string paper;
      for (const double s : kSharpness) {
        ray_opacity.run(ray.distances.data(), sections, s);
        const long double reference = log_transmittance_of({ray.distances.begin(), ray.distances.end()}, s);
        const double expected = double(std::exp(reference));
        worst = std::max(worst, std::abs(std::exp(ray_opacity.log_transmittance()) - expected));
        EXPECT_NEAR(ray_opacity.log_transmittance(), double(reference), 1e-6 * std::abs(double(reference)) + 1e-40)
            << ray.name;
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
        std::vector<float> by_f(sections + 1);
        const auto loss_of = [&](const std::vector<long double>& distances) {
          return 0.3L * std::exp(log_transmittance_of(distances, s));
        };
        ray_opacity.run(ray.distances.data(), sections, s);
        ray_opacity.back(0.3 * std::exp(ray_opacity.log_transmittance()), by_f.data());
        std::vector<long double> f(ray.distances.begin(), ray.distances.end());
        const long double step = 1e-9L / s;
        std::vector<double> expected(sections + 1);
        double largest = 0;
        const size_t stride = sections > 100 ? 811 : 1;
        for (size_t i = 0; i <= sections; i += stride) {
          const long double middle = f[i];
          f[i] = middle + step;
          const long double up = loss_of(f);
          f[i] = middle - step;
          expected[i] = double((up - loss_of(f)) / (2 * step));
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
      }
    }
  }
}

TEST(Opacity, AWallIsOpaqueAndARayFarOutsideIsClear) {
  RayOpacity ray;
  const float wall[4] = {2, 2, -2, -2}, far[4] = {2, 1.5F, 1.2F, 1.8F};
  float by_f[4] = {9, 9, 9, 9};
  ray.run(wall, 3, 1e5);
  EXPECT_LT(ray.log_transmittance(), -1e4);
  ray.back(1, by_f);
  for (const float value : by_f) EXPECT_TRUE(std::isfinite(value));
  ray.run(far, 3, 100);
  EXPECT_EQ(ray.log_transmittance(), 0);
  ray.back(1, by_f);
  for (const float value : by_f) EXPECT_EQ(value, 0);
  ray.run(far, 3, 64);
  EXPECT_LT(ray.log_transmittance(), 0);
  ray.run(wall, 0, 64);  // no section at all
  EXPECT_EQ(ray.log_transmittance(), 0);
}

TEST(Opacity, DistancesThatAreNotFiniteLeaveTheirSectionsClear) {
  RayOpacity ray;
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  const float distances[8] = {1, nan, 1, infinite, 0.5F, -infinite, 0.1F, -0.1F};
  for (const double s : kSharpness) {
    ray.run(distances, 7, s);
    float by_f[8];
    ray.back(1, by_f);
    EXPECT_FALSE(std::isnan(ray.log_transmittance()));
    for (const float value : by_f) EXPECT_TRUE(std::isfinite(value)) << s;
  }
}

}  // namespace
