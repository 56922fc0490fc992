// The mesh of a stored head and its landmarks, on a field whose surface is known exactly.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "head/reconstruction/head_surface.h"
#include "support/expect_error.h"
#include "support/samples/closed_mesh.h"

namespace head_surface_tests {
namespace {

using namespace maq::head;  // NOLINT
using maq::Vec3;
using maq::WorkerThreads;

constexpr float kSmoothing = 1e-8f;

// |x| + |y| + |z| - radius, over sqrt(3), which is a distance nearly: squareplus(v) + squareplus(-v) is |v|.
StoredHead octahedron(float radius) {
  FieldShape shape;
  shape.octaves = 0, shape.width = 6, shape.geometry_layers = 1, shape.feature = 0;
  shape.surface_width = 6, shape.surface_layers = 1, shape.smoothing = kSmoothing;
  shape.personal_geometry_layers = shape.personal_surface_layers = 0;
  StoredHead head{FieldWeights(shape)};
  const float root = std::sqrt(3.0f);
  for (int unit = 0; unit < 6; ++unit) {
    const float sign = unit % 2 == 0 ? 1.0f : -1.0f;
    head.weights.layer(0).row(unit)[unit / 2] = sign;
    head.weights.layer(1).row(0)[unit] = 1 / root;
    // The surface's input is the distance, then the point: the template point is half of the point.
    head.weights.layer(2).row(unit)[1 + unit / 2] = sign;
    head.weights.layer(3).row(3 + unit / 2)[unit] = sign / 2;
  }
  head.weights.layer(1).bias[0] = -radius / root;
  head.weights.layer(3).bias[0] = 2;    // red
  head.weights.layer(3).bias[1] = -2;   // green
  head.weights.layer(3).bias[2] = 200;  // blue
  head.cut = {{0, 0, -0.5}, {0, 0, -1}};
  return head;
}

HeadMesh mesh_of(const StoredHead& head, double cell_m = 0.004, int threads = 1) {
  WorkerThreads workers(threads);
  return head_surface(head, {cell_m}, workers);
}

TEST(HeadSurface, IsClosedAndLiesOnTheFieldAndTheCut) {
  const HeadMesh mesh = mesh_of(octahedron(1));
  const MeshFacts facts = facts_of(mesh);
  EXPECT_TRUE(facts.is_closed);
  EXPECT_TRUE(facts.is_manifold);
  EXPECT_EQ(facts.euler, 2);
  EXPECT_EQ(facts.pieces, 1);
  // The volume is 4/3 without the tip below -0.5: a pyramid of 1/6 of half a cube.
  EXPECT_NEAR(facts.volume, 4.0 / 3 - 1.0 / 12, 0.005);
  size_t on_cap = 0, on_field = 0;
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    const float *p = &mesh.positions[3 * i], *n = &mesh.normals[3 * i];
    const double field = double(std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]) - 1) / std::sqrt(3.0);
    ASSERT_NEAR(std::max(field, -0.5 - double(p[2])), 0, 0.008) << "vertex " << i;
    if (std::abs(p[2] + 0.5f) < 1e-5f && field < -0.02) {
      ++on_cap;
      ASSERT_NEAR(n[2], -1, 1e-5);
    } else if (p[2] > -0.48f && std::min({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])}) > 0.02f) {
      ++on_field;
      ASSERT_NEAR(std::abs(field), 0, 1e-3);
      for (size_t axis = 0; axis < 3; ++axis) {
        ASSERT_NEAR(n[axis], std::copysign(1 / std::sqrt(3.0f), p[axis]), 1e-3f);
      }
    }
  }
  EXPECT_GT(on_cap, 100u);
  EXPECT_GT(on_field, 1000u);
}

TEST(HeadSurface, HasColoursAndTemplatePointsOfTheField) {
  const HeadMesh mesh = mesh_of(octahedron(1));
  ASSERT_EQ(mesh.colours.size(), mesh.positions.size());
  ASSERT_EQ(mesh.template_points.size(), mesh.positions.size());
  for (size_t i = 0; i < mesh.positions.size(); i += 3) {
    ASSERT_EQ(mesh.colours[i], 225);  // 255 / (1 + exp(-2))
    ASSERT_EQ(mesh.colours[i + 1], 30);
    ASSERT_EQ(mesh.colours[i + 2], 255);
    for (size_t axis = 0; axis < 3; ++axis) {
      ASSERT_NEAR(mesh.template_points[i + axis], mesh.positions[i + axis] / 2, 1e-4f);
    }
  }
}

TEST(HeadSurface, IsInTrueDecimetresAndItsCellsInMetres) {
  StoredHead head = octahedron(1);
  const HeadMesh mesh = mesh_of(head, 0.004);
  head.scale.metres_per_unit = 0.2;
  const HeadMesh twice = mesh_of(head, 0.008);
  ASSERT_EQ(twice.triangles, mesh.triangles) << "the same cells of the head's frame";
  for (size_t i = 0; i < mesh.positions.size(); ++i) ASSERT_FLOAT_EQ(twice.positions[i], 2 * mesh.positions[i]);
  EXPECT_EQ(twice.template_points, mesh.template_points) << "the template head is as large as ever";
  EXPECT_GT(mesh_of(head, 0.004).vertex_count(), 3 * mesh.vertex_count());
}

TEST(HeadSurface, IsTheSameForAnyNumberOfThreads) {
  const StoredHead head = octahedron(1);
  const HeadMesh one = mesh_of(head, 0.003, 1), three = mesh_of(head, 0.003, 3);
  EXPECT_EQ(one.triangles, three.triangles);
  EXPECT_EQ(one.positions, three.positions);
  EXPECT_EQ(one.normals, three.normals);
  EXPECT_EQ(one.colours, three.colours);
  EXPECT_EQ(one.template_points, three.template_points);
}

TEST(HeadSurface, AnEmptyFieldAndCellsOutOfRangeAreASentence) {
  expect_error(MAQ_ERROR_UNSUPPORTED, "no surface", [] { mesh_of(octahedron(-1)); });
  for (const double cell_m : {1e-9, -1.0, 1e-4, 0.1, double(NAN), double(INFINITY)}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "m large, but must be", [&] { mesh_of(octahedron(1), cell_m); });
  }
}

TEST(HeadSurface, AFullMeshIsAsFineAsTheTrianglesThatAreLeftNeed) {
  const StoredHead head = octahedron(1);
  WorkerThreads workers(1);
  const auto full_triangles = [&](double cell_m, size_t triangles) {
    SurfaceStats stats;
    head_surface(head, {cell_m, triangles}, workers, &stats);
    return stats.full_triangles;
  };
  EXPECT_EQ(full_triangles(0, kAllTriangles), full_triangles(0.0016, kAllTriangles));
  EXPECT_EQ(full_triangles(0, 60001), full_triangles(0.0016, kAllTriangles));
  EXPECT_EQ(full_triangles(0, 60000), full_triangles(0.0021, kAllTriangles));
}

TEST(HeadSurface, PlacesLieWhereTheAnchorsAroundThemDo) {
  StoredHead head = octahedron(1);
  // Anchors of the template head lie half as far out, and to the left.
  for (int i = 0; i < 8; ++i) {
    const float p[3] = {i % 2 == 0 ? 0.3f : -0.3f, i % 4 < 2 ? 0.3f : -0.3f, i < 4 ? 0.3f : -0.3f};
    for (const float value : p) head.anchors.template_points.push_back(value / 2);
    for (size_t axis = 0; axis < 3; ++axis) head.anchors.points.push_back(p[axis] / 2 + (axis == 0 ? 0.25f : 0));
    head.anchors.sigma.push_back(0.01f * float(i + 1));
  }
  head.landmarks = {{"nose_tip", {0.1f, -0.4f, 0}}, {"anchor", {0.15f, 0.15f, 0.15f}}};
  const HeadLandmark nose = find_head_landmark(head, "nose_tip");
  EXPECT_NEAR(nose.point.x, 0.35, 1e-6);
  EXPECT_NEAR(nose.point.y, -0.4, 1e-6);
  EXPECT_NEAR(nose.point.z, 0, 1e-6);
  EXPECT_GT(nose.sigma, 0.01);
  EXPECT_LT(nose.sigma, 0.08);
  const HeadLandmark anchor = find_head_landmark(head, "anchor");
  EXPECT_NEAR(anchor.point.x, 0.4, 1e-6);
  EXPECT_NEAR(anchor.sigma, 0.01, 1e-6);
  expect_error(MAQ_ERROR_NOT_FOUND, "no landmark named \"elbow\"; it has nose_tip, anchor.",
               [&] { find_head_landmark(head, "elbow"); });
}

}  // namespace
}  // namespace head_surface_tests
