// Images of a head against a ball whose silhouette, depth and normals are known.
#include "head/render/head_renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "support/expect_error.h"
#include "support/samples/ball_mesh.h"

namespace head_renderer_tests {
namespace {

using maq::PinholeCamera;
using maq::RenderedImage;
using maq::head::HeadRenderer;
using maq::head::HeadRenderOptions;
using maq::head::MeshShading;

constexpr double kRadius_m = 0.1, kDistance_m = 0.6;

// From the front: x of the head to the right, y up. Pixels are not square.
PinholeCamera from_the_front(int width_px = 160, int height_px = 120) {
  PinholeCamera camera;
  camera.width_px = width_px, camera.height_px = height_px;
  camera.rotation = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  camera.centre = {0, 0, kDistance_m};
  camera.fx_px = 2.0 * height_px, camera.fy_px = 2.6 * height_px;
  camera.cx_px = (width_px - 1) / 2.0 + 3, camera.cy_px = (height_px - 1) / 2.0 - 2;
  return camera;
}

struct Hit {
  bool is_hit;
  double depth_m, x_m, y_m;  // in the camera
};

Hit hit_of(const PinholeCamera& camera, double column_px, double row_px) {
  const double x = (column_px - camera.cx_px) / camera.fx_px, y = (row_px - camera.cy_px) / camera.fy_px;
  const double a = x * x + y * y + 1, c = kDistance_m * kDistance_m - kRadius_m * kRadius_m;
  const double root = kDistance_m * kDistance_m - a * c;
  const double z = (kDistance_m - std::sqrt(std::max(0.0, root))) / a;
  return {root > 0, z, x * z, y * z};
}

HeadRenderOptions with_shading(MeshShading shading) {
  HeadRenderOptions options;
  options.shading = shading, options.shading_strength = 0, options.threads = 2;
  return options;
}

TEST(HeadRenderer, ShowsWhereRaysMeetTheBallInMetres) {
  HeadRenderer renderer(ball_mesh(0.02f), std::nullopt, with_shading(MeshShading::kColour));
  const PinholeCamera camera = from_the_front();
  RenderedImage picture;
  renderer.render(camera, picture);
  double coverage = 0, expected_coverage = 0;
  int inside = 0;
  for (int row = 0; row < camera.height_px; ++row) {
    for (int column = 0; column < camera.width_px; ++column) {
      const size_t pixel = size_t(row * camera.width_px + column);
      int hits = 0;
      for (int k = 0; k < 64; ++k) {
        hits += hit_of(camera, column + (k % 8 + 0.5) / 8 - 0.5, row + (k / 8 + 0.5) / 8 - 0.5).is_hit ? 1 : 0;
      }
      EXPECT_NEAR(picture.alpha[pixel] / 255.0, hits / 64.0, 0.45) << row << ' ' << column;
      coverage += picture.alpha[pixel] / 255.0, expected_coverage += hits / 64.0;
      if (hits == 0) {
        EXPECT_EQ(picture.depth[pixel], 0);
        EXPECT_EQ(picture.alpha[pixel], 0);
      }
      const Hit hit = hit_of(camera, column, row);
      if (hits < 64 || hit.depth_m > kDistance_m - 0.4 * kRadius_m) continue;  // near the rim it is steep
      ++inside;
      EXPECT_EQ(picture.alpha[pixel], 255);
      EXPECT_NEAR(picture.depth[pixel], hit.depth_m, 4e-4);
      const double normal[3] = {hit.x_m / kRadius_m, hit.y_m / kRadius_m, (hit.depth_m - kDistance_m) / kRadius_m};
      // In the mesh y is to the back and z is up; for apps y is up and z to the front.
      const double own[3] = {normal[0], normal[2], -normal[1]}, of_app[3] = {normal[0], -normal[1], -normal[2]};
      for (size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(picture.normals[3 * pixel + axis], normal[axis], 0.035);
        EXPECT_NEAR(picture.template_points[3 * pixel + axis], 0.05 * of_app[axis], 1.5e-3);
        EXPECT_NEAR(picture.bgr[3 * pixel + 2 - axis], 127.5 + 100 * own[axis], 3.5);
      }
    }
  }
  EXPECT_GT(inside, 2000);
  EXPECT_NEAR(coverage, expected_coverage, 0.004 * expected_coverage);
}

TEST(HeadRenderer, EdgesAreSmoothOrNot) {
  const PinholeCamera camera = from_the_front();
  for (const bool is_smooth : {true, false}) {
    HeadRenderOptions options = with_shading(MeshShading::kColour);
    options.is_smooth = is_smooth;
    HeadRenderer renderer(ball_mesh(0.05f), std::nullopt, options);
    RenderedImage picture;
    renderer.render(camera, picture);
    int between = 0;
    for (const uint8_t alpha : picture.alpha) between += alpha != 0 && alpha != 255 ? 1 : 0;
    if (is_smooth) {
      EXPECT_GT(between, 100);
    } else {
      EXPECT_EQ(between, 0);
    }
  }
}

TEST(HeadRenderer, EachShadingTellsItsQuantity) {
  HeadRenderer renderer(ball_mesh(0.02f), std::nullopt, with_shading(MeshShading::kColour));
  const PinholeCamera camera = from_the_front();
  const size_t pixel = size_t(40 * camera.width_px + 70);
  const Hit hit = hit_of(camera, 70, 40);
  ASSERT_TRUE(hit.is_hit);
  const double normal[3] = {hit.x_m / kRadius_m, hit.y_m / kRadius_m, (hit.depth_m - kDistance_m) / kRadius_m};
  const auto expect_rgb = [&](MeshShading shading, double red, double green, double blue) {
    renderer.set_shading(shading);
    RenderedImage picture;
    renderer.render(camera, picture);
    EXPECT_NEAR(picture.bgr[3 * pixel + 2], red, 3) << int(shading);
    EXPECT_NEAR(picture.bgr[3 * pixel + 1], green, 3) << int(shading);
    EXPECT_NEAR(picture.bgr[3 * pixel], blue, 3) << int(shading);
  };
  expect_rgb(MeshShading::kShape, 200, 200, 200);
  expect_rgb(MeshShading::kNormals, 127.5 + 127.5 * normal[0], 127.5 - 127.5 * normal[1], 127.5 - 127.5 * normal[2]);
  const double half = 127.5 * 0.5 / 1.4;
  expect_rgb(MeshShading::kTemplate, 127.5 + half * normal[0], 127.5 - half * normal[1], 127.5 - half * normal[2]);
  // White and black are as far from the ball's middle as its bounding sphere reaches.
  const double grey = 127.5 - 127.5 * (hit.depth_m - kDistance_m) / kRadius_m;
  expect_rgb(MeshShading::kDepth, grey, grey, grey);
}

TEST(HeadRenderer, TheBackgroundLiesUnderTheHead) {
  HeadRenderOptions options = with_shading(MeshShading::kShape);
  HeadRenderer plain(ball_mesh(0.05f), std::nullopt, options);
  options.background_rgb = {10, 20, 250};
  HeadRenderer over(ball_mesh(0.05f), std::nullopt, options);
  RenderedImage without, with;
  plain.render(from_the_front(), without);
  over.render(from_the_front(), with);
  EXPECT_EQ(without.bgr[0], 0);
  EXPECT_EQ(with.bgr[0], 250);
  EXPECT_EQ(with.bgr[2], 10);
  for (size_t i = 0; i < with.alpha.size(); ++i) {
    ASSERT_EQ(with.alpha[i], without.alpha[i]);
    const double share = with.alpha[i] / 255.0;
    ASSERT_NEAR(with.bgr[3 * i], share * without.bgr[3 * i] + (1 - share) * 250, 1);
  }
}

TEST(HeadRenderer, TheOrbitSeesTheWholeHeadFromWhereItSays) {
  HeadRenderer renderer(ball_mesh(0.05f), std::nullopt, with_shading(MeshShading::kColour));
  const double kQuarter = std::acos(0.0);
  for (const auto& [yaw, pitch, axis, sign] :
       {std::tuple{0.0, 0.0, 2, 1}, std::tuple{kQuarter, 0.0, 0, 1}, std::tuple{-kQuarter, 0.0, 0, -1},
        std::tuple{2 * kQuarter, 0.0, 2, -1}, std::tuple{0.4, kQuarter, 1, 1}, std::tuple{0.4, -kQuarter, 1, -1}}) {
    for (const auto& [width, height] : {std::pair{200, 100}, std::pair{100, 200}}) {
      const PinholeCamera camera = renderer.orbit_camera(yaw, pitch, width, height);
      EXPECT_GT(sign * camera.centre[size_t(axis)], 0.3);
      RenderedImage picture;
      renderer.render(camera, picture);
      int first_row = height, last_row = -1, first_column = width, last_column = -1;
      for (int i = 0; i < width * height; ++i) {
        if (picture.alpha[size_t(i)] == 0) continue;
        first_row = std::min(first_row, i / width), last_row = std::max(last_row, i / width);
        first_column = std::min(first_column, i % width), last_column = std::max(last_column, i % width);
      }
      const int short_side = std::min(width, height);
      EXPECT_NEAR(last_row - first_row + 1, short_side / 1.03, 3);
      EXPECT_NEAR(last_column - first_column + 1, short_side / 1.03, 3);
      EXPECT_NEAR(first_row + last_row, height - 1, 2);
      EXPECT_NEAR(first_column + last_column, width - 1, 2);
    }
  }
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "finite", [&] { renderer.orbit_camera(std::nan(""), 0, 10, 10); });
  expect_error(MAQ_ERROR_IMAGE_SIZE, "0 x 10", [&] { renderer.orbit_camera(0, 0, 0, 10); });
}

TEST(HeadRenderer, HostileCamerasGetAPictureOrASentence) {
  HeadRenderer renderer(ball_mesh(0.1f), std::nullopt, with_shading(MeshShading::kColour));
  RenderedImage picture;
  const auto refused = [&](maq_status status, const char* text, auto&& change) {
    PinholeCamera camera = from_the_front(20, 16);
    change(camera);
    expect_error(status, text, [&] { renderer.render(camera, picture); });
  };
  const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinite, -infinite}) {
    refused(MAQ_ERROR_INVALID_ARGUMENT, "not finite", [&](PinholeCamera& c) { c.fx_px = bad; });
    refused(MAQ_ERROR_INVALID_ARGUMENT, "not finite", [&](PinholeCamera& c) { c.cy_px = bad; });
    refused(MAQ_ERROR_INVALID_ARGUMENT, "not finite", [&](PinholeCamera& c) { c.centre[1] = bad; });
    refused(MAQ_ERROR_INVALID_ARGUMENT, "not finite", [&](PinholeCamera& c) { c.rotation[4] = bad; });
  }
  refused(MAQ_ERROR_INVALID_ARGUMENT, "must be positive", [](PinholeCamera& c) { c.fy_px = 0; });
  refused(MAQ_ERROR_INVALID_ARGUMENT, "m away", [](PinholeCamera& c) { c.centre[0] = 1e200; });
  refused(MAQ_ERROR_INVALID_ARGUMENT, "mirrors", [](PinholeCamera& c) { c.rotation[0] = -1; });
  refused(MAQ_ERROR_IMAGE_SIZE, "0 x 0", [](PinholeCamera& c) { c.width_px = c.height_px = 0; });
  refused(MAQ_ERROR_IMAGE_SIZE, "20000 x 20000", [](PinholeCamera& c) { c.width_px = c.height_px = 20000; });
  refused(MAQ_ERROR_INVALID_ARGUMENT, "", [](PinholeCamera& c) { c.fx_px = 1e-300, c.fy_px = 1e300; });

  const auto covered = [&](auto&& change) {
    PinholeCamera camera = from_the_front(20, 16);
    change(camera);
    renderer.render(camera, picture);
    int count = 0;
    for (size_t i = 0; i < picture.alpha.size(); ++i) {
      count += picture.alpha[i] != 0 ? 1 : 0;
      EXPECT_TRUE(std::isfinite(picture.depth[i]) && std::isfinite(picture.normals[3 * i]));
    }
    return count;
  };
  EXPECT_GT(covered([](PinholeCamera&) {}), 40);
  EXPECT_EQ(covered([](PinholeCamera& c) { c.centre[2] = -0.6; }), 0) << "the head is behind it";
  EXPECT_EQ(covered([](PinholeCamera& c) { c.centre[2] = 1e30; }), 0);
  EXPECT_LE(covered([](PinholeCamera& c) { c.fx_px = c.fy_px = 1e-30; }), 1);
  EXPECT_LE(covered([](PinholeCamera& c) { c.fx_px = c.fy_px = 1e-310; }), 1);
  EXPECT_GE(covered([](PinholeCamera& c) { c.fx_px = c.fy_px = 1e30; }), 0);
  EXPECT_GE(covered([](PinholeCamera& c) { c.fx_px = c.fy_px = 1e300; }), 0);
  EXPECT_EQ(covered([](PinholeCamera& c) { c.cx_px = 1e300; }), 0);
  EXPECT_GE(covered([](PinholeCamera& c) { c.centre[2] = 0; }), 0) << "inside of the head";
  EXPECT_GE(covered([](PinholeCamera& c) { c.centre[2] = 0.1; }), 0) << "on its surface";
  EXPECT_EQ(covered([](PinholeCamera& c) { c.width_px = c.height_px = 1; }) & ~1, 0);
  expect_error(MAQ_ERROR_UNSUPPORTED, "no surface", [] { HeadRenderer({}, std::nullopt, {}); });
}

}  // namespace
}  // namespace head_renderer_tests
