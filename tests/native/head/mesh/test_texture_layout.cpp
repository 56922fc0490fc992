// Where points of the head lie in a texture: in one piece, symmetric, the cap apart.
#include <gtest/gtest.h>

#include <cmath>

#include "head/mesh/marching_cubes.h"
#include "head/mesh/mesh_cleanup.h"
#include "head/texture/texture_layout.h"

namespace texture_layout_tests {
namespace {

using maq::Vec3;
using maq::head::HeadMesh;
using maq::head::is_in_cap_disc;
using maq::head::texture_place;

// A ball of radius 1 that ends below, whose template points are its own.
HeadMesh cut_ball() {
  maq::head::MarchingCubesOptions options;
  options.box_min = {-1.2f, -1.2f, -1.2f}, options.box_max = {1.2f, 1.2f, 1.2f}, options.cell = 0.05f;
  maq::WorkerThreads threads(1);
  HeadMesh mesh = marching_cubes(
      [](const float* x, const float* y, const float* z, float* f, size_t n) {
        for (size_t i = 0; i < n; ++i) f[i] = std::max(std::hypot(x[i], y[i], z[i]) - 1, -0.9f - z[i]);
      },
      options, threads);
  maq::head::set_normals(mesh);
  mesh.template_points = mesh.positions;
  mesh.colours.resize(mesh.positions.size());
  return mesh;
}

TEST(TextureLayout, TheFaceIsUprightInTheLowerHalfAndLeftIsRight) {
  const auto crown = texture_place({0, 0, 1}), face = texture_place({0, -1, 0}), chin = texture_place({0, -0.8, -1.1});
  EXPECT_EQ(crown[0], 0.5f);
  EXPECT_EQ(crown[1], 0.5f);
  EXPECT_EQ(face[0], 0.5f);
  EXPECT_GT(face[1], 0.6f);
  EXPECT_GT(chin[1], face[1]);
  EXPECT_LT(texture_place({0, 1, 0})[1], 0.4f) << "the back";
  const auto left = texture_place({0.7, -0.6, 0.1}), right = texture_place({-0.7, -0.6, 0.1});
  EXPECT_GT(left[0], 0.5f);
  EXPECT_FLOAT_EQ(left[0], 1 - right[0]);
  EXPECT_FLOAT_EQ(left[1], right[1]);
  for (const Vec3 p : {Vec3{0, 0, -5}, Vec3{1, 0, -5}, Vec3{0, 0, -0.6}, Vec3{9, 9, 9}}) {
    const auto place = texture_place(p);
    EXPECT_LE(std::hypot(place[0] - 0.5f, place[1] - 0.5f), 0.486f);
    EXPECT_FALSE(is_in_cap_disc(place[0], place[1]));
  }
}

TEST(TextureLayout, ABallHasNoFoldsAndTheCapIsApart) {
  HeadMesh mesh = cut_ball();
  const size_t triangles = mesh.triangle_count(), vertices = mesh.vertex_count();
  const auto is_cap = maq::head::find_cap(mesh, {0, 0, -1}, 0.9f, 0.003f);
  maq::head::set_texture_coordinates(mesh, is_cap);
  EXPECT_EQ(mesh.triangle_count(), triangles);
  EXPECT_GT(mesh.vertex_count(), vertices);
  EXPECT_LT(mesh.vertex_count(), vertices + 200) << "those of the rim";
  for (const auto* values : {&mesh.positions, &mesh.normals, &mesh.template_points}) {
    EXPECT_EQ(values->size(), 3 * mesh.vertex_count());
  }
  EXPECT_EQ(mesh.colours.size(), 3 * mesh.vertex_count());
  ASSERT_EQ(mesh.texture_coordinates.size(), 2 * mesh.vertex_count());
  size_t on_cap = 0;
  for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const uint32_t* const t = &mesh.triangles[i];
    float u[3], v[3];
    int in_disc = 0;
    for (size_t k = 0; k < 3; ++k) {
      u[k] = mesh.texture_coordinates[2 * t[k]], v[k] = mesh.texture_coordinates[2 * t[k] + 1];
      in_disc += is_in_cap_disc(u[k], v[k]);
      ASSERT_TRUE(u[k] >= 0 && u[k] <= 1 && v[k] >= 0 && v[k] <= 1);
    }
    ASSERT_TRUE(in_disc == 0 || in_disc == 3) << "no triangle reaches from one disc to the other";
    on_cap += in_disc == 3;
    // Seen from outside, as the texture is: v goes down.
    ASSERT_LT((u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0]), 0) << "triangle " << i / 3;
  }
  EXPECT_GT(on_cap, 50u);
}

TEST(TextureLayout, EqualDirectionsHaveEqualAreas) {
  // The upper half of all directions is half of a whole sphere; the border is at 165 degrees.
  const double upper = std::hypot(texture_place({1, 0, -0.6})[0] - 0.5, 0), all = std::hypot(0.485, 0);
  EXPECT_NEAR(upper * upper / (all * all), 0.5 / std::pow(std::sin(165 * 3.14159265 / 360), 2), 1e-4);
}

}  // namespace
}  // namespace texture_layout_tests
