#include "scene/format/scene_packing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <iostream>
#include <numeric>

#include "scene/format/block_codec.h"
#include "scene/point_cloud.h"
#include "support/expect_error.h"
#include "support/peak_memory.h"
#include "support/samples/fitted_scene.h"

namespace {

using maq::CoefficientFormat;
using maq::FittedPoints;
using maq::kBasis;
using maq::kFeatures;
using maq::kLinearTerms;
using maq::PositionFormat;
using maq::Scene;
using maq::SceneBlock;

constexpr maq::ScenePacking kExact = {PositionFormat::kFloat32, CoefficientFormat::kFloat32,
                                      0};  // all linear terms are kept

// All points of a scene in the order in which they were given.
FittedPoints unpack(const Scene& scene, const std::vector<uint32_t>& order) {
  FittedPoints all;
  for (auto* axis : {&all.x, &all.y, &all.z}) axis->resize(scene.points);
  all.constant_terms.resize(scene.points * size_t(kFeatures));
  all.linear_terms.resize(scene.points * kLinearTerms);
  for (uint32_t b = 0; b < scene.block_count; ++b) {
    const SceneBlock& block = scene.blocks[b];
    const FittedPoints part = decode_block(scene, block);
    for (uint32_t k = 0; k < block.count; ++k) {
      const size_t i = order[block.first + k];
      all.x[i] = part.x[k];
      all.y[i] = part.y[k];
      all.z[i] = part.z[k];
      std::copy_n(&part.constant_terms[k * size_t(kFeatures)], kFeatures, &all.constant_terms[i * kFeatures]);
      std::copy_n(&part.linear_terms[k * kLinearTerms], kLinearTerms, &all.linear_terms[i * kLinearTerms]);
    }
  }
  return all;
}

struct DescriptorError {
  double rms = 0, worst = 0;
};

// Error of y(h) over basis values of length 1, in all directions; points in `skipped` do not count.
DescriptorError descriptor_error(const FittedPoints& given, const FittedPoints& stored,
                                 std::vector<uint32_t> skipped = {}) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  DescriptorError error;
  size_t count = 0;
  for (uint32_t i = 0; i < given.count(); ++i) {
    if (std::find(skipped.begin(), skipped.end(), i) != skipped.end()) continue;
    double h[kBasis], length = 0;
    for (double& value : h) {
      value = normal(random);
      length += value * value;
    }
    for (size_t c = 0; c < size_t(kFeatures); ++c) {
      double off = double(stored.constant_terms[i * kFeatures + c]) - given.constant_terms[i * kFeatures + c];
      for (size_t k = 0; k < size_t(kBasis); ++k) {
        const size_t at = i * kLinearTerms + k * kFeatures + c;
        off += h[k] / std::sqrt(length) * (double(stored.linear_terms[at]) - given.linear_terms[at]);
      }
      error.rms += off * off;
      error.worst = std::max(error.worst, std::abs(off));
      ++count;
    }
  }
  error.rms = std::sqrt(error.rms / double(count));
  return error;
}

TEST(ScenePacking, EveryPointIsInOneBlockAndBlocksAreSmallAndFull) {
  const FittedPoints points = ball_over_a_floor(50'000);
  const std::vector<uint32_t> order = order_points(points, kExact).points;
  const Scene scene = make_scene(points, kExact);
  EXPECT_EQ(scene.points, 50'000u);
  EXPECT_EQ(scene.block_count, 49u);
  std::vector<uint32_t> sorted = order, all(50'000);
  std::sort(sorted.begin(), sorted.end());
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(sorted, all);
  uint32_t first = 0, first_view_dependent = 0;
  for (uint32_t b = 0; b < scene.block_count; ++b) {
    const SceneBlock& block = scene.blocks[b];
    EXPECT_EQ(block.first, first);
    EXPECT_EQ(block.first_view_dependent, first_view_dependent);
    EXPECT_LE(block.count, SceneBlock::kMaxPoints);
    first += block.count;
    first_view_dependent += block.view_dependent;
    // A 49th of the floor and the ball is about 0.6 a side.
    for (int axis = 0; axis < 3; ++axis) EXPECT_LT(block.high[axis] - block.low[axis], 1.2f) << b;
  }
  EXPECT_EQ(first, scene.points);
  EXPECT_EQ(first_view_dependent, scene.view_dependent);
}

TEST(ScenePacking, FloatsAreThoseGiven) {
  const FittedPoints points = ball_over_a_floor(5'000);
  const std::vector<uint32_t> order = order_points(points, kExact).points;
  const FittedPoints stored = unpack(make_scene(points, kExact), order);
  EXPECT_EQ(stored.x, points.x);
  EXPECT_EQ(stored.y, points.y);
  EXPECT_EQ(stored.z, points.z);
  EXPECT_EQ(stored.constant_terms, points.constant_terms);
  EXPECT_EQ(stored.linear_terms, points.linear_terms);
}

TEST(ScenePacking, PositionsOf16BitsAreWithinHalfAStepAndInTheirBox) {
  const FittedPoints points = ball_over_a_floor(20'000);
  const std::vector<uint32_t> order =
      order_points(points, {PositionFormat::kUint16, CoefficientFormat::kInt8, 0}).points;
  const Scene scene = make_scene(points, {PositionFormat::kUint16, CoefficientFormat::kInt8, 0});
  for (uint32_t b = 0; b < scene.block_count; ++b) {
    const SceneBlock& block = scene.blocks[b];
    const FittedPoints part = decode_block(scene, block);
    const std::vector<float>* given[3] = {&points.x, &points.y, &points.z};
    const std::vector<float>* stored[3] = {&part.x, &part.y, &part.z};
    for (int axis = 0; axis < 3; ++axis) {
      float largest = -INFINITY;
      for (uint32_t k = 0; k < block.count; ++k) {
        largest = std::max(largest, (*given[axis])[order[block.first + k]]);
      }
      EXPECT_NEAR(block.high[axis], largest, 1e-5);  // all steps are used
    }
    for (uint32_t k = 0; k < block.count; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        const float at = (*stored[axis])[k];
        ASSERT_NEAR(at, (*given[axis])[order[block.first + k]], 0.5 * block.position_step[axis] + 1e-7);
        ASSERT_GE(at, block.low[axis]);
        ASSERT_LE(at, block.high[axis]);
      }
    }
  }
}

TEST(ScenePacking, ItsErrorIsSmallForDescriptorsOfAnySize) {
  for (const float size : {1e-6f, 1.0f, 1e6f}) {
    FittedPoints points = ball_over_a_floor(20'000);
    for (float& value : points.constant_terms) value *= size;
    for (float& value : points.linear_terms) value *= size;
    for (const CoefficientFormat kind : {CoefficientFormat::kInt16, CoefficientFormat::kInt8}) {
      const std::vector<uint32_t> order = order_points(points, {PositionFormat::kUint16, kind, 0}).points;
      const Scene scene = make_scene(points, {PositionFormat::kUint16, kind, 0});
      const DescriptorError error = descriptor_error(points, unpack(scene, order));
      const bool is_int8 = kind == CoefficientFormat::kInt8;
      std::cout << "descriptors of " << size << (is_int8 ? ", int8" : ", int16") << ": error " << error.rms / size
                << " RMS, " << error.worst / size << " at worst, of their size\n";
      EXPECT_LT(error.rms, (is_int8 ? 1e-3 : 5e-6) * size);
      EXPECT_LT(error.worst, (is_int8 ? 4e-3 : 2e-5) * size);
      EXPECT_GT(error.rms, 1e-7 * size);
    }
  }
}

TEST(ScenePacking, LessViewDependentPointsKeepTheConstantTermAlone) {
  const FittedPoints points = ball_over_a_floor(10'000);
  const float min = 0.1f;
  const std::vector<uint32_t> order =
      order_points(points, {PositionFormat::kFloat32, CoefficientFormat::kFloat32, min}).points;
  const Scene scene = make_scene(points, {PositionFormat::kFloat32, CoefficientFormat::kFloat32, min});
  EXPECT_EQ(scene.view_dependent, std::count_if(points.view_dependence.begin(), points.view_dependence.end(),
                                                [&](float view_dependence) { return view_dependence >= min; }));
  const FittedPoints stored = unpack(scene, order);
  EXPECT_EQ(stored.constant_terms, points.constant_terms);
  for (size_t i = 0; i < points.count(); ++i) {
    for (size_t k = 0; k < kLinearTerms; ++k) {
      const float wanted = points.view_dependence[i] >= min ? points.linear_terms[i * kLinearTerms + k] : 0.0f;
      ASSERT_EQ(stored.linear_terms[i * kLinearTerms + k], wanted);
    }
  }
}

TEST(ScenePacking, TheFractionOfViewDependentPointsIsKeptByTheMostViewDependent) {
  FittedPoints points = ball_over_a_floor(10'000);
  maq::ScenePacking packing = kExact;
  for (const float fraction : {0.0f, 0.3f, 0.9999f, 1.0f}) {
    packing.max_view_dependent_fraction = fraction;
    const std::vector<uint32_t> order = order_points(points, packing).points;
    const Scene scene = make_scene(points, packing);
    EXPECT_NEAR(scene.view_dependent, fraction * 10'000, 1);
    float min_kept = 1e9f, max_dropped = 0;
    for (uint32_t b = 0; b < scene.block_count; ++b) {
      const SceneBlock& block = scene.blocks[b];
      for (uint32_t k = 0; k < block.count; ++k) {
        const float view_dependence = points.view_dependence[order[block.first + k]];
        if (k < block.view_dependent) min_kept = std::min(min_kept, view_dependence);
        if (k >= block.view_dependent) max_dropped = std::max(max_dropped, view_dependence);
      }
    }
    EXPECT_GE(min_kept, max_dropped);
  }
  std::fill(points.view_dependence.begin(), points.view_dependence.end(), 1.0f);
  packing.max_view_dependent_fraction = 0.5f;
  EXPECT_LE(make_scene(points, packing).view_dependent, 5'000u);
  for (const float fraction : {-0.1f, 1.5f, float(NAN)}) {
    packing.max_view_dependent_fraction = fraction;
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "fraction of view-dependent points", [&] { make_scene(points, packing); });
  }
}

TEST(ScenePacking, AScenesBytesAPointAreAtMost39WithHalfOfThemViewDependent) {
  const FittedPoints points = ball_over_a_floor(20'000);
  const Scene scene = make_scene(points, {PositionFormat::kUint16, CoefficientFormat::kInt8, 0, 0.5f});
  const size_t bytes =
      blocks_bytes(scene) + positions_bytes(scene) + constant_terms_bytes(scene) + linear_terms_bytes(scene);
  EXPECT_EQ(scene.view_dependent, 10'000u);
  EXPECT_LT(double(bytes) / scene.points, 39);
}

TEST(ScenePacking, LinearTermsThatAreZeroAreNotStored) {
  FittedPoints points = ball_over_a_floor(3'000);
  std::fill(points.linear_terms.begin() + 1'000 * kLinearTerms, points.linear_terms.end(), 0.0f);
  EXPECT_EQ(make_scene(points, kExact).view_dependent, 1'000u);
}

TEST(ScenePacking, AnOutlierDoesNotSpoilItsNeighbours) {
  const maq::ScenePacking packing = {PositionFormat::kUint16, CoefficientFormat::kInt8, 0};
  FittedPoints points = ball_over_a_floor(20'000);
  const auto error_of = [&](const std::vector<uint32_t>& skipped) {
    return descriptor_error(points, unpack(make_scene(points, packing), order_points(points, packing).points), skipped);
  };
  const DescriptorError before = error_of({});
  const std::vector<uint32_t> outliers = {17, 4'711, 12'345, 12'347};
  for (const uint32_t i : outliers) {
    for (int c = 0; c < kFeatures; ++c) points.constant_terms[i * kFeatures + size_t(c)] = 1e6f + float(i);
    for (size_t k = 0; k < kLinearTerms; ++k) points.linear_terms[i * kLinearTerms + k] = 1e5f;
  }
  points.constant_terms[99 * kFeatures] = -1e20f;  // and one among the outliers
  const Scene scene = make_scene(points, packing);
  const FittedPoints stored = unpack(scene, order_points(points, packing).points);
  const DescriptorError after = error_of({17, 99, 4'711, 12'345, 12'347});
  EXPECT_LT(after.worst, 1.2 * before.worst);
  for (const uint32_t i : outliers) {
    EXPECT_NEAR(stored.constant_terms[i * kFeatures], points.constant_terms[i * kFeatures], 100);
    EXPECT_NEAR(stored.linear_terms[i * kLinearTerms], 1e5f, 1e3);
  }
  EXPECT_NEAR(stored.constant_terms[99 * kFeatures] / -1e20, 1, 1e-6);
  EXPECT_LE(scene.block_count, 22u + 1);
}

TEST(ScenePacking, APointFarAwayDoesNotSpoilItsNeighbours) {
  FittedPoints points = ball_over_a_floor(20'000);
  points.x[5] = 3e7f;
  points.y[6] = -1e12f;
  const std::vector<uint32_t> order =
      order_points(points, {PositionFormat::kUint16, CoefficientFormat::kInt8, 0}).points;
  const Scene scene = make_scene(points, {PositionFormat::kUint16, CoefficientFormat::kInt8, 0});
  const FittedPoints stored = unpack(scene, order);
  for (size_t i = 0; i < points.count(); ++i) {
    ASSERT_NEAR(stored.x[i], points.x[i], 2e-5f + 1e-6f * std::abs(points.x[i])) << i;
    ASSERT_NEAR(stored.y[i], points.y[i], 2e-5f + 1e-6f * std::abs(points.y[i])) << i;
  }
  EXPECT_LE(scene.block_count, 20u + 6);
}

TEST(ScenePacking, BlocksStayFewHoweverPointsAreSpread) {
  FittedPoints points = ball_over_a_floor(4'096);
  for (size_t i = 0; i < points.count(); ++i) {
    points.x[i] = std::ldexp(1.0f, -3 * int(i % 40));  // a gap of 7/8 of what is left, again and again
    points.y[i] = points.z[i] = 0;
  }
  EXPECT_LE(make_scene(points, kExact).block_count, 4u * 4);
}

TEST(ScenePacking, OnePointAndPointsAtOnePosition) {
  for (const size_t count : {size_t(1), size_t(2), size_t(3), size_t(3'000)}) {
    FittedPoints points = ball_over_a_floor(count);
    std::fill(points.x.begin(), points.x.end(), 0.1f);
    std::fill(points.y.begin(), points.y.end(), -7e-30f);
    std::fill(points.z.begin(), points.z.end(), 1e30f);
    for (const CoefficientFormat kind :
         {CoefficientFormat::kFloat32, CoefficientFormat::kInt16, CoefficientFormat::kInt8}) {
      for (const PositionFormat positions : {PositionFormat::kFloat32, PositionFormat::kUint16}) {
        const std::vector<uint32_t> order = order_points(points, {positions, kind, 0}).points;
        const Scene scene = make_scene(points, {positions, kind, 0});
        const FittedPoints stored = unpack(scene, order);
        EXPECT_EQ(stored.x, points.x);
        EXPECT_EQ(stored.y, points.y);
        EXPECT_EQ(stored.z, points.z);
        EXPECT_LT(descriptor_error(points, stored).worst, 5e-3);
        if (count == 1) {
          EXPECT_LT(descriptor_error(points, stored).worst, 1e-7);
        }
      }
    }
  }
}

TEST(ScenePacking, TheLargestNumbersStayFinite) {
  FittedPoints points = ball_over_a_floor(2'000);
  for (size_t i = 0; i < points.count(); ++i) {
    points.x[i] = i % 2 == 0 ? maq::kMaxMagnitude : -maq::kMaxMagnitude;
    points.constant_terms[i * kFeatures] = points.x[i];
    points.linear_terms[i * kLinearTerms + 3] = points.x[i];
  }
  for (const CoefficientFormat kind : {CoefficientFormat::kInt16, CoefficientFormat::kInt8}) {
    const std::vector<uint32_t> order = order_points(points, {PositionFormat::kUint16, kind, 0}).points;
    const FittedPoints stored = unpack(make_scene(points, {PositionFormat::kUint16, kind, 0}), order);
    for (const auto* values : {&stored.x, &stored.y, &stored.z, &stored.constant_terms, &stored.linear_terms}) {
      EXPECT_TRUE(std::all_of(values->begin(), values->end(), [](float value) { return std::isfinite(value); }));
    }
    EXPECT_NEAR(stored.x[4] / maq::kMaxMagnitude, 1, 1e-4);
  }
}

TEST(ScenePacking, WhatIsNoSceneIsRefused) {
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "no point", [] { make_scene(FittedPoints(), {}); });
  const auto refused = [](const char* text, auto&& change) {
    FittedPoints points = ball_over_a_floor(100);
    change(points);
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, text, [&] { make_scene(points, {}); });
  };
  refused("descriptor of point 60", [](auto& points) { points.constant_terms[60 * 8 + 7] = NAN; });
  refused("descriptor of point 61", [](auto& points) { points.linear_terms[61 * 48 + 47] = -INFINITY; });
  refused("descriptor of point 62", [](auto& points) { points.linear_terms[62 * 48] = 2e30f; });
  refused("descriptor of point 63", [](auto& points) { points.view_dependence[63] = NAN; });
  refused("Point 64", [](auto& points) { points.y[64] = NAN; });
  refused("Point 65", [](auto& points) { points.z[65] = -3e30f; });
  refused("origin", [](auto& points) { points.origin[2] = NAN; });
  refused("origin", [](auto& points) { points.up[0] = INFINITY; });
  refused("100 points", [](auto& points) { points.y.pop_back(); });
  refused("100 points", [](auto& points) { points.constant_terms.pop_back(); });
  refused("100 points", [](auto& points) { points.linear_terms.clear(); });
  refused("100 points", [](auto& points) { points.view_dependence.clear(); });
}

TEST(ScenePacking, TheSamePointsMakeTheSameScene) {
  const FittedPoints points = ball_over_a_floor(5'000);
  const Scene a = make_scene(points, {}), b = make_scene(points, {});
  EXPECT_EQ(std::memcmp(a.blocks, b.blocks, blocks_bytes(a)), 0);
  EXPECT_EQ(std::memcmp(a.positions, b.positions, positions_bytes(a)), 0);
  EXPECT_EQ(std::memcmp(a.constant_terms, b.constant_terms, constant_terms_bytes(a)), 0);
  EXPECT_EQ(std::memcmp(a.linear_terms, b.linear_terms, linear_terms_bytes(a)), 0);
}

// The points themselves take 248 bytes each.
TEST(ScenePacking, MillionsOfPointsTakeMemoryByTheirNumber) {
  constexpr size_t kCount = 1'000'000;
  const FittedPoints points = ball_over_a_floor(kCount);
  const auto begin = std::chrono::steady_clock::now();
  const double grown_mib = peak_memory_growth_mib([&] { EXPECT_EQ(make_scene(points, {}).points, kCount); });
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  std::cout << kCount << " points: " << taken.count() << " s, " << grown_mib << " MiB\n";
  EXPECT_LT(grown_mib, 120 * kCount / 1048576.0);
}

}  // namespace
