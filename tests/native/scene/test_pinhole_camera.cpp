#include "image/geometry/pinhole_camera.h"

#include <gtest/gtest.h>

#include <cmath>

#include "scene/gravity_alignment.h"
#include "support/samples/synthetic_scene.h"

namespace {

using maq::PinholeCamera;

TEST(PinholeCamera, ASmallerPictureOfTheSameCameraShowsTheSame) {
  const PinholeCamera camera = camera_of(640, 480, 60), half = maq::resized(camera, 320, 240);
  EXPECT_DOUBLE_EQ(half.fx_px, camera.fx_px / 2);
  // The centre of a block of four pixels is that of the small one.
  EXPECT_DOUBLE_EQ((0.5 - camera.cx_px) / camera.fx_px, (0 - half.cx_px) / half.fx_px);
}

TEST(PinholeCamera, GravityAlignmentIsContinuousWhereUpIsAlongTheAxis) {
  PinholeCamera camera = camera_of(100, 100, 60);
  for (const double roll : {0.0, 0.5, 2.0, -3.0}) {
    camera.rotation = {std::cos(roll), -std::sin(roll), 0, std::sin(roll), std::cos(roll), 0, 0, 0, 1};
    const PinholeCamera aligned = maq::gravity_aligned(camera, {0, -2, 0});
    EXPECT_NEAR(aligned.rotation[0], 1, 1e-12) << roll;
    EXPECT_NEAR(aligned.rotation[4], 1, 1e-12) << roll;
    maq::check_camera(aligned, "The camera");
  }
  const PinholeCamera along = maq::gravity_aligned(camera, {0, 0, 1});
  EXPECT_EQ(along.rotation, camera.rotation);
  EXPECT_EQ(maq::gravity_aligned(camera, {0, 0, 0}).rotation, camera.rotation);
  std::array<double, 9> before = along.rotation;
  for (double tilt = 0; tilt < 0.1; tilt += 1e-4) {
    const auto rotation = maq::gravity_aligned(camera, {std::sin(tilt), 0, std::cos(tilt)}).rotation;
    for (size_t i = 0; i < 9; ++i) EXPECT_NEAR(rotation[i], before[i], 0.02) << tilt;
    before = rotation;
  }
}

}  // namespace
