// Surfaces that must be closed and manifold whatever the field is.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "head/mesh/cube_triangles.h"
#include "head/mesh/marching_cubes.h"
#include "support/expect_error.h"
#include "support/samples/closed_mesh.h"

namespace {

using maq::WorkerThreads;
using maq::head::HeadMesh;
using maq::head::marching_cubes;
using maq::head::MarchingCubesOptions;
using maq::head::MarchingCubesStats;
using maq::head::ScalarField;

// Values at the points of a grid of unit cells, trilinear between them.
struct GridField {
  int size;  // points of a side
  std::vector<float> values;

  float& at(int x, int y, int z) { return values[size_t((z * size + y) * size + x)]; }
  float get(int x, int y, int z) const { return values[size_t((z * size + y) * size + x)]; }
  float operator()(float x, float y, float z) const {
    const auto cell = [this](float v) { return std::clamp(int(std::floor(v)), 0, size - 2); };
    const int ix = cell(x), iy = cell(y), iz = cell(z);
    const double fx = double(x) - ix, fy = double(y) - iy, fz = double(z) - iz;
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
      const double weight = ((c & 1) != 0 ? fx : 1 - fx) * ((c & 2) != 0 ? fy : 1 - fy) * ((c & 4) != 0 ? fz : 1 - fz);
      if (weight != 0) sum += weight * double(get(ix + (c & 1), iy + (c >> 1 & 1), iz + (c >> 2)));
    }
    return float(sum);
  }
  ScalarField field() const {
    return [this](const float* x, const float* y, const float* z, float* f, size_t n) {
      for (size_t i = 0; i < n; ++i) f[i] = (*this)(x[i], y[i], z[i]);
    };
  }
  // Options with slopes that exclude nothing.
  MarchingCubesOptions options() const {
    MarchingCubesOptions made;
    made.box_min = {0, 0, 0};
    made.box_max = {float(size - 1), float(size - 1), float(size - 1)};
    made.cell = 1;
    made.max_slope = 1e6f;
    return made;
  }
};

GridField grid(int size, float value) { return {size, std::vector<float>(size_t(size * size * size), value)}; }

void expect_sound(const HeadMesh& mesh, const std::string& what, double cell = 1) {
  const MeshFacts facts = facts_of(mesh);
  EXPECT_TRUE(facts.is_closed) << what;
  EXPECT_TRUE(facts.is_manifold) << what;
  EXPECT_EQ(facts.euler % 2, 0) << what;
  if (mesh.triangle_count() > 0) {
    EXPECT_GT(facts.smallest_area, 1e-4 * cell * cell) << what;
    EXPECT_GT(facts.volume, 0) << what;
  }
}

// A ball; with a margin for a cell, by the distance times `slope`.
ScalarField ball(float radius, float slope = 1, float x0 = 0) {
  return [=](const float* x, const float* y, const float* z, float* f, size_t n) {
    for (size_t i = 0; i < n; ++i) {
      f[i] = slope * (std::sqrt((x[i] - x0) * (x[i] - x0) + y[i] * y[i] + z[i] * z[i]) - radius);
    }
  };
}

double largest_radius_error(const HeadMesh& mesh, double radius) {
  double worst = 0;
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    const float* p = &mesh.positions[3 * i];
    worst = std::max(worst, std::abs(std::hypot(double(p[0]), double(p[1]), double(p[2])) - radius));
  }
  return worst;
}

TEST(MarchingCubes, NoCellPutsTheSideOfATriangleIntoAFaceOfItsOwn) {
  for (int inside = 0; inside < 256; ++inside) {
    const auto& triangles = maq::head::cube_triangles()[size_t(inside)];
    ASSERT_LE(triangles.count, 5);
    std::map<std::pair<int, int>, int> sides;
    for (int i = 0; i < triangles.count; ++i) {
      for (int k = 0; k < 3; ++k) {
        ++sides[{triangles.edges[size_t(3 * i + k)], triangles.edges[size_t(3 * i + (k + 1) % 3)]}];
      }
    }
    for (const auto& [side, count] : sides) {
      EXPECT_EQ(count, 1) << inside;
      const bool is_segment = sides.count({side.second, side.first}) == 0;
      // The faces on which both ends lie.
      bool on_one_face = false;
      for (int axis = 0; axis < 3; ++axis) {
        for (int far = 0; far < 2; ++far) {
          const auto lies = [&](int edge) {
            return edge / 4 != axis && (maq::head::first_corner(edge) >> axis & 1) == far;
          };
          on_one_face = on_one_face || (lies(side.first) && lies(side.second));
        }
      }
      EXPECT_EQ(is_segment, on_one_face) << inside;
    }
  }
}

TEST(MarchingCubes, EachOfThe256CellsIsClosedAmongCornersOutsideAndInside) {
  WorkerThreads threads(1);
  for (const float border : {1.0f, -1.0f}) {
    for (int inside = 0; inside < 256; ++inside) {
      GridField around = grid(6, border);
      for (int c = 0; c < 8; ++c) {
        around.at(2 + (c & 1), 2 + (c >> 1 & 1), 2 + (c >> 2)) = (inside >> c & 1) != 0 ? -1.0f : 1.0f;
      }
      const HeadMesh mesh = marching_cubes(around.field(), around.options(), threads);
      expect_sound(mesh, "cell " + std::to_string(inside) + ", border " + std::to_string(border));
      EXPECT_EQ(mesh.triangle_count() == 0, border > 0 && inside == 0);
    }
  }
}

TEST(MarchingCubes, NoiseIsClosedAndManifold) {
  WorkerThreads threads(1);
  std::mt19937 random(7);
  for (int round = 0; round < 20; ++round) {
    GridField noise = grid(17, 0);
    for (float& value : noise.values) value = float(random() % 2001) / 1000 - 1;
    expect_sound(marching_cubes(noise.field(), noise.options(), threads), "noise " + std::to_string(round));
  }
}

TEST(MarchingCubes, ValuesAtAndAroundZeroAreOnOneSide) {
  WorkerThreads threads(1);
  std::mt19937 random(8);
  const float kinds[] = {0.0f, -0.0f, 1e-38f, -1e-38f, 1e-45f, -1e-45f, 1, -1, 1e30f, -1e30f};
  for (int round = 0; round < 20; ++round) {
    GridField tiny = grid(17, 0);
    for (float& value : tiny.values) value = kinds[random() % std::size(kinds)];
    expect_sound(marching_cubes(tiny.field(), tiny.options(), threads), "tiny " + std::to_string(round));
  }
  const GridField zeros = grid(9, 0);
  EXPECT_EQ(marching_cubes(zeros.field(), zeros.options(), threads).triangle_count(), 0u);
}

TEST(MarchingCubes, ValuesThatAreNoNumbersAreAnError) {
  WorkerThreads threads(2);
  for (const float value : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    GridField field = grid(9, 1);
    field.at(4, 5, 3) = value;
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "The field is",
                 [&] { marching_cubes(field.field(), field.options(), threads); });
  }
}

TEST(MarchingCubes, AnEmptySetHasNoMeshAndAFullOneIsTheBox) {
  WorkerThreads threads(1);
  const GridField outside = grid(9, 1), inside = grid(9, -1);
  const HeadMesh none = marching_cubes(outside.field(), outside.options(), threads);
  EXPECT_EQ(none.vertex_count(), 0u);
  EXPECT_EQ(none.triangle_count(), 0u);
  const HeadMesh box = marching_cubes(inside.field(), inside.options(), threads);
  expect_sound(box, "full");
  const MeshFacts facts = facts_of(box);
  EXPECT_EQ(facts.euler, 2);
  EXPECT_LT(facts.volume, 512);  // 8 units a side; each edge of the box is bevelled by half a cell
  EXPECT_GT(facts.volume, 512 - 12 * 8 * 0.5 - 6 * 64 * maq::head::kMinFraction);
}

TEST(MarchingCubes, ABallIsRoundToAThousandth) {
  WorkerThreads threads(2);
  MarchingCubesOptions options;
  options.box_min = {-1.3f, -1.3f, -1.3f}, options.box_max = {1.3f, 1.3f, 1.3f};
  // Not a distance: linear interpolation alone is off.
  const ScalarField field = [](const float* x, const float* y, const float* z, float* f, size_t n) {
    for (size_t i = 0; i < n; ++i) {
      const float r = std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
      f[i] = (r - 1) * (1 + 20 * std::max(0.0f, r - 1));
    }
  };
  options.max_slope = 14;
  const HeadMesh mesh = marching_cubes(field, options, threads);
  expect_sound(mesh, "ball", 0.016);
  const MeshFacts facts = facts_of(mesh);
  EXPECT_EQ(facts.euler, 2);
  EXPECT_EQ(facts.pieces, 1);
  EXPECT_NEAR(facts.volume, 4.0 / 3 * 3.14159265, 2e-3);
  // Corners repel vertices by a 64th of a cell, the rest is exact.
  EXPECT_LT(largest_radius_error(mesh, 1), 0.016 / 64 + 2e-5);
  options.refine_steps = 0;
  EXPECT_GT(largest_radius_error(marching_cubes(field, options, threads), 1), 5e-4);
}

TEST(MarchingCubes, ABallEvaluatesAFractionOfTheGrid) {
  WorkerThreads threads(2);
  MarchingCubesOptions options;
  options.box_min = {-1.28f, -1.28f, -1.28f}, options.box_max = {1.28f, 1.28f, 1.28f}, options.cell = 0.01f;
  for (const float slope : {1.0f, 1.5f}) {
    options.max_slope = slope;
    MarchingCubesStats stats;
    const HeadMesh mesh = marching_cubes(ball(1), options, threads, &stats);
    EXPECT_EQ(stats.grid_points, size_t(257) * 257 * 257);
    EXPECT_GT(stats.evaluations, mesh.vertex_count());
    EXPECT_LT(stats.evaluations, stats.grid_points / 10) << slope;
    RecordProperty("evaluations", std::to_string(stats.evaluations));
  }
}

TEST(MarchingCubes, WhatTheBoxCutsIsClosedThere) {
  WorkerThreads threads(1);
  MarchingCubesOptions options;
  options.box_min = {-0.5f, -2, -2}, options.box_max = {2, 2, 0.33f}, options.cell = 0.05f;
  const HeadMesh mesh = marching_cubes(ball(1), options, threads);
  expect_sound(mesh, "cut", 0.05);
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    EXPECT_GE(mesh.positions[3 * i], -0.5f);
    EXPECT_LE(mesh.positions[3 * i + 2], 0.33f + 0.0025f);  // the field bends within a cell: a 20th of that
  }
  // By integration of discs of the ball, each cut at x = -0.5.
  double volume = 0;
  for (int i = 0; i < 1000; ++i) {
    const double z = -1 + 1.33 * (i + 0.5) / 1000, r = std::sqrt(1 - z * z);
    const double h = std::min(0.5, r);
    volume += 1.33 / 1000 * (r * r * (3.14159265 - std::acos(h / r)) + h * std::sqrt(r * r - h * h));
  }
  EXPECT_NEAR(facts_of(mesh).volume, volume, 0.01);
}

TEST(MarchingCubes, ASteeperFieldThanToldLeavesNothingOpen) {
  WorkerThreads threads(1);
  MarchingCubesOptions options;
  options.box_min = {-1.3f, -1.3f, -1.3f}, options.box_max = {1.3f, 1.3f, 1.3f}, options.cell = 0.05f;
  options.max_slope = 1;
  const HeadMesh mesh = marching_cubes(ball(1, 3), options, threads);
  ASSERT_GT(mesh.triangle_count(), 0u);
  expect_sound(mesh, "steep", 0.05);
  EXPECT_EQ(facts_of(mesh).euler, 2);
  options.max_slope = 3;
  EXPECT_EQ(mesh.vertex_count(), marching_cubes(ball(1, 3), options, threads).vertex_count());
}

TEST(MarchingCubes, GridsThatAreTooLargeOrWrongAreRefused) {
  WorkerThreads threads(1);
  const auto refuse = [&](maq_status status, const char* text, MarchingCubesOptions options) {
    expect_error(status, text, [&] { marching_cubes(ball(1), options, threads); });
  };
  MarchingCubesOptions options;
  options.cell = 0.004f;
  refuse(MAQ_ERROR_INVALID_ARGUMENT, "1024 is the limit", options);
  options.cell = 1e-9f;
  refuse(MAQ_ERROR_INVALID_ARGUMENT, "size of 1e-09", options);
  for (const float cell : {0.0f, -1.0f, std::nanf(""), std::numeric_limits<float>::infinity()}) {
    options.cell = cell;
    refuse(MAQ_ERROR_INVALID_ARGUMENT, "have a size of", options);
  }
  options = {};
  options.box_max[1] = -3;
  refuse(MAQ_ERROR_INVALID_ARGUMENT, "to -3", options);
  options.box_max[1] = std::nanf("");
  refuse(MAQ_ERROR_INVALID_ARGUMENT, "whose sides are positive", options);
  options = {};
  options.max_points = 10000;
  refuse(MAQ_ERROR_OUT_OF_MEMORY, "more than 10000 points", options);
  options = {};
  options.max_slope = 0;
  refuse(MAQ_ERROR_INVALID_ARGUMENT, "positive slope", options);
}

TEST(MarchingCubes, BoxesSmallerThanACellHaveASurface) {
  WorkerThreads threads(1);
  MarchingCubesOptions options;
  options.box_min = {-0.01f, -0.01f, -0.01f}, options.box_max = {0.01f, 0.01f, 0.01f}, options.cell = 1;
  const HeadMesh mesh = marching_cubes(ball(1), options, threads);
  const MeshFacts facts = facts_of(mesh);
  EXPECT_TRUE(facts.is_closed && facts.is_manifold);
}

TEST(MarchingCubes, FailuresOfTheFieldReachTheCaller) {
  WorkerThreads threads(2);
  const ScalarField field = [](const float*, const float*, const float*, float*, size_t) {
    throw maq::Error(MAQ_ERROR_INFERENCE, "No field.");
  };
  expect_error(MAQ_ERROR_INFERENCE, "No field.", [&] { marching_cubes(field, {}, threads); });
}

}  // namespace
