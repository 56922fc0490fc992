// Images of meshes against rays.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "head/mesh/mesh_raster.h"
#include "support/expect_error.h"
#include "support/samples/ball_mesh.h"

namespace {

using maq::RenderedImage;
using maq::WorkerThreads;
using maq::head::HeadCamera;
using maq::head::HeadMesh;
using maq::head::MeshRaster;

// From the front, 6 away: x of the head to the right, z up.
HeadCamera front(int width_px, int height_px) {
  HeadCamera camera;
  camera.width_px = width_px, camera.height_px = height_px;
  camera.head_to_camera.rotation = {1, 0, 0, 0, 0, -1, 0, 1, 0};
  camera.head_to_camera.translation = {0, 0, 6};
  camera.focal_px = 2.2 * height_px, camera.cx_px = width_px / 2.0, camera.cy_px = height_px / 2.0;
  return camera;
}

HeadMesh one_triangle(std::vector<float> positions) {
  HeadMesh mesh;
  mesh.positions = std::move(positions);
  mesh.triangles = {0, 1, 2};
  return mesh;
}

TEST(MeshRaster, ShowsABallWhereRaysMeetIt) {
  WorkerThreads threads(2);
  MeshRaster raster;
  RenderedImage image;
  const HeadMesh mesh = ball_mesh(0.02f);
  const HeadCamera camera = front(160, 120);
  maq::head::RasterOptions options;
  options.ambient = 1;
  raster.draw(mesh, camera, options, threads, image);
  int wrong = 0, seen = 0;
  for (int row = 0; row < 120; ++row) {
    for (int column = 0; column < 160; ++column) {
      const double x = (column - camera.cx_px) / camera.focal_px, y = (row - camera.cy_px) / camera.focal_px;
      const double a = x * x + y * y + 1, root = 36 - a * 35;
      const size_t pixel = size_t(row * 160 + column);
      if (std::abs(root) < 0.3) continue;  // its rim
      if ((root > 0) != (image.alpha[pixel] == 255)) ++wrong;
      if (root < 0) {
        EXPECT_EQ(image.depth[pixel], 0);
        continue;
      }
      ++seen;
      const double z = (6 - std::sqrt(root)) / a;
      EXPECT_NEAR(image.depth[pixel], z, 2e-3);
      const double normal[3] = {x * z, y * z, z - 6};
      for (size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(image.normals[3 * pixel + axis], normal[axis], 0.03);
      EXPECT_NEAR(image.bgr[3 * pixel + 2], 127.5 + 100 * x * z, 1.5);    // R: x
      EXPECT_NEAR(image.bgr[3 * pixel], 127.5 - 100 * y * z, 1.5);        // B: z
      EXPECT_NEAR(image.bgr[3 * pixel + 1], 127.5 + 100 * (z - 6), 1.5);  // G: y
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(seen, 4000);
}

TEST(MeshRaster, TwoThreadsDrawThePictureOfOne) {
  const HeadMesh mesh = ball_mesh(0.05f);
  WorkerThreads one(1), two(2);
  MeshRaster raster;
  RenderedImage a, b;
  raster.draw(mesh, front(161, 123), {}, one, a);
  raster.draw(mesh, front(161, 123), {}, two, b);
  EXPECT_EQ(a.bgr, b.bgr);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.normals, b.normals);
}

TEST(MeshRaster, ClosedMeshesHaveNoHoles) {
  WorkerThreads threads(1);
  MeshRaster raster;
  RenderedImage image;
  const HeadMesh mesh = ball_mesh(0.1f);
  HeadCamera camera = front(320, 320);
  camera.cx_px = camera.cy_px = 160;  // grid lines of the mesh fall on pixels
  raster.draw(mesh, camera, {}, threads, image);
  for (int row = 0; row < 320; ++row) {
    for (int column = 0; column < 320; ++column) {
      if (std::hypot(row - 160, column - 160) > 110) continue;
      const float depth = image.depth[size_t(row * 320 + column)];
      EXPECT_TRUE(depth > 4.9f && depth < 5.8f) << row << ' ' << column;
    }
  }
}

TEST(MeshRaster, TheGroundToTheHorizonIsCutAtTheNearPlane) {
  WorkerThreads threads(1);
  MeshRaster raster;
  RenderedImage image;
  HeadCamera camera;
  camera.width_px = 41, camera.height_px = 40, camera.focal_px = 20, camera.cx_px = 20, camera.cy_px = 20;
  // One triangle in y = 1 that begins behind the camera.
  raster.draw(one_triangle({-1000, 1, -5, 1000, 1, -5, 0, 1, 1000}), camera, {}, threads, image);
  for (int row = 0; row < 40; ++row) {
    const float depth = image.depth[size_t(row * 41 + 20)];
    if (row > 20) {
      EXPECT_NEAR(depth, 20.0 / (row - 20), 1e-4);
    } else {
      EXPECT_EQ(depth, 0);
    }
  }
  maq::head::RasterOptions options;
  options.near = 1.5f;  // reaches to row 33
  raster.draw(one_triangle({-1000, 1, -5, 1000, 1, -5, 0, 1, 1000}), camera, options, threads, image);
  EXPECT_EQ(image.alpha[33 * 41 + 20], 255);
  EXPECT_EQ(image.alpha[34 * 41 + 20], 0);
}

TEST(MeshRaster, WhatIsDegenerateOrBehindIsSkipped) {
  WorkerThreads threads(1);
  MeshRaster raster;
  RenderedImage image;
  HeadCamera camera;
  camera.width_px = 16, camera.height_px = 16, camera.focal_px = 8, camera.cx_px = 8, camera.cy_px = 8;
  for (const HeadMesh& mesh :
       {HeadMesh(), one_triangle({0, 0, 2, 0, 0, 2, 0, 0, 2}), one_triangle({-1, 0, 2, 0, 0, 2, 1, 0, 2}),
        one_triangle({0, -1, 2, 0, 0, 3, 0, 1, 2}), one_triangle({-1, -1, -2, 1, -1, -2, 0, 1, -2}),
        one_triangle({std::nanf(""), -1, 2, 1, -1, 2, 0, 1, 2})}) {
    raster.draw(mesh, camera, {}, threads, image);
    EXPECT_EQ(std::count(image.alpha.begin(), image.alpha.end(), 255), 0);
  }
  raster.draw(one_triangle({-1, -1, 2, 1, -1, 2, 0, 1, 2}), camera, {}, threads, image);
  EXPECT_GT(std::count(image.alpha.begin(), image.alpha.end(), 255), 20);
}

}  // namespace
