// One piece of a mesh, its normals, and its cap.
#include <gtest/gtest.h>

#include <cmath>

#include "head/mesh/marching_cubes.h"
#include "head/mesh/mesh_cleanup.h"
#include "support/samples/closed_mesh.h"

namespace {

using maq::WorkerThreads;
using maq::head::HeadMesh;
using maq::head::MarchingCubesOptions;

// Balls of radius 0.3 and 0.5, cut at z = 0.2.
void two_balls(const float* x, const float* y, const float* z, float* f, size_t n) {
  for (size_t i = 0; i < n; ++i) {
    const float left = std::hypot(x[i] + 1, y[i], z[i]) - 0.3f, right = std::hypot(x[i] - 0.6f, y[i], z[i]) - 0.5f;
    f[i] = std::max(std::min(left, right), z[i] - 0.2f);
  }
}

HeadMesh cut_balls() {
  MarchingCubesOptions options;
  options.box_min = {-1.5f, -1, -1}, options.box_max = {1.5f, 1, 1}, options.cell = 0.05f;
  WorkerThreads threads(1);
  return marching_cubes(two_balls, options, threads);
}

TEST(MeshCleanup, TheLargestPieceStaysWithAllThatBelongsToIt) {
  HeadMesh mesh = cut_balls();
  ASSERT_EQ(facts_of(mesh).pieces, 2);
  mesh.template_points = mesh.positions;
  mesh.colours.resize(mesh.positions.size());
  for (size_t i = 0; i < mesh.vertex_count(); ++i) mesh.colours[3 * i] = mesh.positions[3 * i] > 0 ? 200 : 10;
  maq::head::keep_largest_piece(mesh);
  const MeshFacts facts = facts_of(mesh);
  EXPECT_EQ(facts.pieces, 1);
  EXPECT_TRUE(facts.is_closed && facts.is_manifold);
  EXPECT_EQ(mesh.template_points, mesh.positions);
  ASSERT_EQ(mesh.colours.size(), mesh.positions.size());
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    EXPECT_GT(mesh.positions[3 * i], 0);
    EXPECT_EQ(mesh.colours[3 * i], 200);
  }
  const size_t count = mesh.triangle_count();
  maq::head::keep_largest_piece(mesh);
  EXPECT_EQ(mesh.triangle_count(), count);
}

TEST(MeshCleanup, AnEmptyMeshStaysEmpty) {
  HeadMesh mesh;
  maq::head::keep_largest_piece(mesh);
  maq::head::set_normals(mesh);
  EXPECT_TRUE(mesh.positions.empty() && mesh.normals.empty());
}

TEST(MeshCleanup, NormalsOfTheGradientAndOfTrianglesPointOutwards) {
  MarchingCubesOptions options;
  options.box_min = {-1.2f, -1.2f, -1.2f}, options.box_max = {1.2f, 1.2f, 1.2f}, options.cell = 0.05f;
  WorkerThreads threads(2);
  HeadMesh mesh = marching_cubes(
      [](const float* x, const float* y, const float* z, float* f, size_t n) {
        for (size_t i = 0; i < n; ++i) f[i] = std::hypot(x[i], y[i], z[i]) - 1;
      },
      options, threads);
  const auto worst_cosine = [&] {
    double worst = 1;
    for (size_t i = 0; i < mesh.positions.size(); i += 3) {
      const float *p = &mesh.positions[i], *n = &mesh.normals[i];
      EXPECT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 1e-5);
      worst = std::min(worst, double(p[0] * n[0] + p[1] * n[1] + p[2] * n[2]) / std::hypot(p[0], p[1], p[2]));
    }
    return worst;
  };
  maq::head::set_normals(mesh);
  EXPECT_GT(worst_cosine(), 0.995);
  // Three times as long, and unknown on one side, where the triangles' stay.
  const auto gradient = [](const float* x, const float* y, const float* z, float* gx, float* gy, float* gz, size_t n) {
    for (size_t i = 0; i < n; ++i) {
      const float scale = x[i] > 0.5f ? 3.0f : x[i] > 0.2f ? 0.0f : std::nanf("");
      gx[i] = scale * x[i], gy[i] = scale * y[i], gz[i] = scale * z[i];
    }
  };
  const HeadMesh before = mesh;
  maq::head::set_normals(mesh, gradient, threads);
  EXPECT_GT(worst_cosine(), 0.995);
  for (size_t i = 0; i < mesh.positions.size(); i += 3) {
    const float *p = &mesh.positions[i], *n = &mesh.normals[i];
    if (p[0] > 0.5f) {
      EXPECT_NEAR(n[0], p[0] / std::hypot(p[0], p[1], p[2]), 1e-5);
    } else {
      EXPECT_EQ(n[0], before.normals[i]);
    }
  }
}

TEST(MeshCleanup, TheCapIsWhatLiesInThePlane) {
  const HeadMesh mesh = cut_balls();
  const auto is_cap = maq::head::find_cap(mesh, {0, 0, 1}, 0.2f, 0.002f);
  double area = 0;
  for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const uint32_t* t = &mesh.triangles[i];
    if (!is_cap[t[0]] || !is_cap[t[1]] || !is_cap[t[2]]) continue;
    const float *p = &mesh.positions[3 * t[0]], *q = &mesh.positions[3 * t[1]], *r = &mesh.positions[3 * t[2]];
    area += double((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / 2;
  }
  const double discs = 3.14159 * (0.21 + 0.05), rims = 6.28318 * (std::sqrt(0.21) + std::sqrt(0.05));
  EXPECT_LT(area, discs);
  EXPECT_GT(area, discs - rims * 0.05);  // the rim is bevelled by less than a cell
}

}  // namespace
