// Which way is up, found from how cameras are held.
#include <gtest/gtest.h>

#include <cmath>

#include "scene/capture/scene_up.h"

namespace maq {
namespace {

constexpr double kDegree = 0.017453292519943295;

using Rotation = std::array<double, 9>;

// A camera that looks towards `azimuth` about +z, tilted down, then rolled about its axis; degrees.
Rotation looking(double azimuth, double down, double roll = 0) {
  const double a = azimuth * kDegree, t = down * kDegree, r = roll * kDegree;
  const std::array<double, 3> right = {std::sin(a), -std::cos(a), 0};
  const std::array<double, 3> forward = {std::cos(a) * std::cos(t), std::sin(a) * std::cos(t), -std::sin(t)};
  const std::array<double, 3> below = {forward[1] * right[2] - forward[2] * right[1],
                                       forward[2] * right[0] - forward[0] * right[2],
                                       forward[0] * right[1] - forward[1] * right[0]};
  Rotation rotation{};
  for (size_t i = 0; i < 3; ++i) {
    rotation[i] = std::cos(r) * right[i] + std::sin(r) * below[i];
    rotation[3 + i] = std::cos(r) * below[i] - std::sin(r) * right[i];
    rotation[6 + i] = forward[i];
  }
  return rotation;
}

double degrees_from_z(const std::array<double, 3>& up) {
  EXPECT_NEAR(std::hypot(up[0], up[1], up[2]), 1, 1e-12);
  return std::acos(std::min(up[2], 1.0)) / kDegree;
}

TEST(SceneUp, CamerasThatAllLookDownFromOneSideDoNotTiltIt) {
  std::vector<Rotation> cameras;
  for (int k = 0; k < 12; ++k) cameras.push_back(looking(-45 + 90 * k / 11.0, 40));
  EXPECT_LT(degrees_from_z(up_of_cameras(cameras)), 1.5);  // the mean of their ups is off by over 35 degrees
}

TEST(SceneUp, RollOfSomeDegreesAveragesOut) {
  std::vector<Rotation> cameras;
  for (int k = 0; k < 24; ++k) cameras.push_back(looking(15 * k, 20, k % 2 == 0 ? 4 : -4));
  EXPECT_LT(degrees_from_z(up_of_cameras(cameras)), 0.5);
}

TEST(SceneUp, OneCameraOrManyAlikeSayWhatIsUpInTheirPicture) {
  const Rotation camera = looking(30, 25, 7);
  for (size_t count : {1, 5}) {
    const auto up = up_of_cameras(std::vector<Rotation>(count, camera));
    for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(up[i], -camera[3 + i], 1e-12);
  }
}

TEST(SceneUp, PhotosHeldOnEdgeAmongOthersDoNotTurnIt) {
  std::vector<Rotation> cameras;
  for (int k = 0; k < 24; ++k) cameras.push_back(looking(15 * k, 10, k % 3 == 0 ? 90 : 0));
  EXPECT_LT(degrees_from_z(up_of_cameras(cameras)), 1);
}

TEST(SceneUp, WhereUpsCancelOutTheFirstCounts) {
  const std::vector<Rotation> cameras = {looking(0, 0), looking(0, 0, 180)};
  EXPECT_LT(degrees_from_z(up_of_cameras(cameras)), 1e-6);
  EXPECT_EQ(up_of_cameras({}), (std::array<double, 3>{0, 0, 1}));
}

}  // namespace
}  // namespace maq
