// Fewer triangles: the mesh stays closed and manifold, near where it was, and the same each time.
#include <gtest/gtest.h>

#include <cmath>

#include "head/mesh/marching_cubes.h"
#include "head/mesh/mesh_simplify.h"
#include "support/samples/closed_mesh.h"

namespace mesh_simplify_tests {
namespace {

using maq::WorkerThreads;
using maq::head::HeadMesh;
using maq::head::largest_distance;
using maq::head::simplify_mesh;

template <class Field>
HeadMesh surface_of(Field&& field, float cell = 0.05f) {
  maq::head::MarchingCubesOptions options;
  options.box_min = {-1.5f, -1.5f, -1.5f}, options.box_max = {1.5f, 1.5f, 1.5f}, options.cell = cell;
  WorkerThreads threads(1);
  return marching_cubes(
      [&](const float* x, const float* y, const float* z, float* f, size_t n) {
        for (size_t i = 0; i < n; ++i) f[i] = field(x[i], y[i], z[i]);
      },
      options, threads);
}

float ball(float x, float y, float z) { return std::hypot(x, y, z) - 1; }
float cut_ball(float x, float y, float z) { return std::max(ball(x, y, z), -0.5f - z); }
float ring(float x, float y, float z) { return std::hypot(std::hypot(x, y) - 0.9f, z) - 0.3f; }

double distance_of(const std::vector<float>& points, const HeadMesh& mesh, int count = 1) {
  WorkerThreads threads(count);
  return largest_distance(points, mesh, threads);
}

TEST(MeshSimplify, ClosedManifoldsStaySoDownToTheFewestTriangles) {
  for (const auto field : {ball, cut_ball, ring}) {
    const HeadMesh full = surface_of(field);
    const MeshFacts before = facts_of(full);
    for (const size_t triangles : {5000u, 1000u, 200u, 30u, 1u}) {
      HeadMesh mesh = full;
      simplify_mesh(mesh, triangles);
      const MeshFacts facts = facts_of(mesh);
      EXPECT_TRUE(facts.is_closed) << triangles;
      EXPECT_TRUE(facts.is_manifold) << triangles;
      EXPECT_EQ(facts.euler, before.euler) << triangles;
      EXPECT_EQ(facts.pieces, 1) << triangles;
      EXPECT_GT(facts.smallest_area, 0) << triangles;
      if (triangles >= 200) {
        EXPECT_EQ(mesh.triangle_count(), triangles);
        EXPECT_NEAR(facts.volume, before.volume, 0.05 * before.volume) << triangles;
      }
    }
  }
}

TEST(MeshSimplify, TheSurfaceStaysWhereItWas) {
  const HeadMesh full = surface_of(ball, 0.025f);
  double last = 0;
  for (const size_t triangles : {10000u, 2500u, 600u}) {
    HeadMesh mesh = full;
    simplify_mesh(mesh, triangles);
    const double error = distance_of(full.positions, mesh);
    // Triangles of the best ball lie within half their sagitta: edge^2 / 12 of it at their middle, of equal ones.
    const double edge_squared = 4 / std::sqrt(3.0) * 4 * 3.14159 / double(triangles);
    EXPECT_LT(error, 0.4 * edge_squared) << triangles;
    EXPECT_GT(error, last) << triangles;
    last = error;
  }
}

TEST(MeshSimplify, FlatPartsGoFirstAndEdgesStaySharp) {
  const auto box = [](float x, float y, float z) { return std::max({std::abs(x), std::abs(y), std::abs(z)}) - 0.777f; };
  const HeadMesh full = surface_of(box);
  HeadMesh mesh = full;
  simplify_mesh(mesh, full.triangle_count() / 10);
  // Marching cubes bevels the edges by less than a cell; what was flat has not moved.
  EXPECT_LT(distance_of(full.positions, mesh), 0.01);
}

TEST(MeshSimplify, IsTheSameEachTimeAndKeepsWhatIsSmallEnough) {
  const HeadMesh full = surface_of(cut_ball);
  HeadMesh one = full, other = full, same = full;
  simplify_mesh(one, 700), simplify_mesh(other, 700), simplify_mesh(same, full.triangle_count());
  EXPECT_EQ(one.positions, other.positions);
  EXPECT_EQ(one.triangles, other.triangles);
  EXPECT_EQ(same.positions, full.positions);
  EXPECT_EQ(same.triangles, full.triangles);
}

TEST(MeshSimplify, DistancesAreThoseOfTheNearestTriangle) {
  HeadMesh mesh;
  mesh.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  mesh.triangles = {0, 1, 2};
  const auto from = [&](float x, float y, float z) { return distance_of({x, y, z}, mesh); };
  EXPECT_NEAR(from(0.2f, 0.2f, 0.5f), 0.5, 1e-6) << "its inside";
  EXPECT_NEAR(from(0.5f, -2, 0), 2, 1e-6) << "sides";
  EXPECT_NEAR(from(-3, 0.5f, 4), 5, 1e-6);
  EXPECT_NEAR(from(1, 1, 0), std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(from(-3, -4, 0), 5, 1e-6) << "corners";
  EXPECT_NEAR(from(4, -4, 0), 5, 1e-6);
  EXPECT_NEAR(from(-4, 4, 0), 5, 1e-6);
  const HeadMesh full = surface_of(ball), coarse = surface_of(ball, 0.2f);
  const double one = distance_of(full.positions, coarse, 1);
  EXPECT_EQ(distance_of(full.positions, coarse, 3), one) << "for any number of threads";
  // Against all triangles: a grid may miss none. Points of a larger ball lie outside of it.
  std::vector<float> points(full.positions.begin(), full.positions.begin() + 300);
  for (size_t i = 0; i < 150; ++i) points[i] *= 1.5f;
  double largest = 0;
  for (size_t i = 0; i < points.size(); i += 3) {
    double nearest = 1e300;
    for (size_t t = 0; t < coarse.triangles.size(); t += 3) {
      HeadMesh single;
      for (size_t k = 0; k < 3; ++k) {
        const float* const p = &coarse.positions[3 * coarse.triangles[t + k]];
        single.positions.insert(single.positions.end(), p, p + 3);
      }
      single.triangles = {0, 1, 2};
      nearest = std::min(nearest, distance_of({points[i], points[i + 1], points[i + 2]}, single));
    }
    largest = std::max(largest, nearest);
  }
  EXPECT_NEAR(distance_of(points, coarse), largest, 1e-6);
}

}  // namespace
}  // namespace mesh_simplify_tests
