// Cameras from correspondences, against the cameras that made them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "head/camera/camera_pose.h"
#include "head/camera/pose_refinement.h"

namespace {

using maq::Vec3;
using maq::head::CameraPose;
using maq::head::CameraPoseOptions;
using maq::head::Correspondence;
using maq::head::exp_rotation;
using maq::head::find_camera_pose;
using maq::head::HeadCamera;
using maq::head::PoseStatus;

class Random {
 public:
  explicit Random(unsigned seed) : bits_(seed) {}
  double uniform() { return (double(bits_()) + 0.5) / 4294967296.0; }
  double normal() { return std::sqrt(-2 * std::log(uniform())) * std::cos(6.283185307179586 * uniform()); }
  Vec3 direction() { return maq::normalized({normal(), normal(), normal()}); }

 private:
  std::mt19937 bits_;
};

// The camera before the face: z forward is the head's y, y down its -z.
const maq::head::Mat3 kFrontal = {1, 0, 0, 0, 0, -1, 0, 1, 0};

HeadCamera camera_at(double distance_dm, double focal_px, Vec3 rotation) {
  return {{exp_rotation(rotation) * kFrontal, {0.1, -0.2, distance_dm}}, focal_px, 320, 240};
}

Correspondence seen(const HeadCamera& camera, Vec3 p, double noise_px, Random& random) {
  const Vec3 q = camera.head_to_camera * p;
  return {p, camera.focal_px * q.x / q.z + camera.cx_px + noise_px * random.normal(),
          camera.focal_px * q.y / q.z + camera.cy_px + noise_px * random.normal(), std::max(noise_px, 0.01)};
}

// Points of a head (an ellipsoid 2 dm wide) that the camera sees.
std::vector<Correspondence> head_points(const HeadCamera& camera, size_t count, double noise_px, Random& random) {
  const Vec3 eye = maq::head::inverse(camera.head_to_camera) * Vec3{};
  std::vector<Correspondence> points;
  while (points.size() < count) {
    const Vec3 d = random.direction(), p = {d.x * 0.8, d.y, d.z * 1.2}, normal = {d.x / 0.8, d.y, d.z / 1.2};
    if (maq::dot(normal, eye - p) > 0) points.push_back(seen(camera, p, noise_px, random));
  }
  return points;
}

void spoil(std::vector<Correspondence>& points, double fraction, Random& random) {
  double low_x = 1e9, high_x = -1e9, low_y = 1e9, high_y = -1e9;
  for (const Correspondence& p : points) {
    low_x = std::min(low_x, p.x_px), high_x = std::max(high_x, p.x_px);
    low_y = std::min(low_y, p.y_px), high_y = std::max(high_y, p.y_px);
  }
  for (size_t i = 0; i < size_t(fraction * double(points.size()) + 0.5); ++i) {
    points[i].x_px = low_x + (high_x - low_x) * random.uniform();
    points[i].y_px = low_y + (high_y - low_y) * random.uniform();
  }
}

CameraPoseOptions known(const HeadCamera& camera) { return {camera.focal_px, 0, camera.cx_px, camera.cy_px}; }

CameraPoseOptions prior_of(const HeadCamera& camera, double factor, double sigma) {
  return {camera.focal_px * factor, sigma, camera.cx_px, camera.cy_px};
}

double rotation_error(const CameraPose& pose, const HeadCamera& truth) {
  return maq::length(
      maq::head::log_rotation(pose.camera.head_to_camera.rotation * maq::transposed(truth.head_to_camera.rotation)));
}

double translation_error(const CameraPose& pose, const HeadCamera& truth) {
  return maq::length(pose.camera.head_to_camera.translation - truth.head_to_camera.translation);
}

TEST(CameraPose, ExactPointsGiveTheCameraFrom4To10000) {
  Random random(1);
  for (const size_t count : {4, 5, 6, 7, 10, 30, 100, 1000, 10000}) {
    for (int trial = 0; trial < (count > 100 ? 2 : 20); ++trial) {
      const HeadCamera camera = camera_at(6, 900, 0.7 * random.direction());
      const CameraPose pose = find_camera_pose(head_points(camera, count, 0, random), known(camera));
      ASSERT_EQ(pose.status, PoseStatus::kFound) << count << " " << trial;
      EXPECT_LT(rotation_error(pose, camera), 1e-8);
      EXPECT_LT(translation_error(pose, camera), 1e-7);
      EXPECT_EQ(pose.inliers, count);
      EXPECT_LT(pose.rms_px, 1e-6);
    }
  }
}

TEST(CameraPose, SixtyPercentOutliersAreFound) {
  Random random(2);
  for (const size_t count : {50, 200, 1000}) {
    for (int trial = 0; trial < 20; ++trial) {
      const HeadCamera camera = camera_at(5, 800, 0.8 * random.direction());
      std::vector<Correspondence> points = head_points(camera, count, 1, random);
      spoil(points, 0.6, random);
      const CameraPose pose = find_camera_pose(points, known(camera));
      ASSERT_EQ(pose.status, PoseStatus::kFound) << count << " " << trial;
      EXPECT_LT(rotation_error(pose, camera),
                4 * std::sqrt(pose.covariance[0] + pose.covariance[8] + pose.covariance[16]));
      EXPECT_NEAR(double(pose.inliers), 0.4 * double(count), 0.04 * double(count) + 1);
      EXPECT_NEAR(pose.rms_sigma, 1, 0.35);
    }
  }
}

TEST(CameraPose, RotationsNearZeroAndNearPiAreFound) {
  Random random(3);
  for (const double angle : {0.0, 1e-9, 1e-4, 3.141592, 3.14159265358979}) {
    for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}, random.direction()}) {
      HeadCamera camera = camera_at(7, 1000, {});
      camera.head_to_camera.rotation = exp_rotation(angle * axis);
      const CameraPose pose = find_camera_pose(head_points(camera, 60, 0, random), known(camera));
      ASSERT_EQ(pose.status, PoseStatus::kFound) << angle;
      EXPECT_LT(rotation_error(pose, camera), 1e-8) << angle;
    }
  }
}

TEST(CameraPose, CollinearPointsAndPointsInOnePlaceAreAStatus) {
  Random random(4);
  const HeadCamera camera = camera_at(6, 900, {0.1, 0.3, 0});
  for (const double length : {0.0, 1.0}) {
    std::vector<Correspondence> points;
    for (int i = 0; i < 20; ++i) {
      points.push_back(seen(camera, {length * i / 20, -1, length * i / 40}, 0.5, random));
    }
    EXPECT_EQ(find_camera_pose(points, known(camera)).status, PoseStatus::kCollinear);
    EXPECT_EQ(find_camera_pose(points, prior_of(camera, 1, 0.5)).status, PoseStatus::kCollinear);
    // The points that could decide are wrong.
    for (int i = 0; i < 6; ++i) {
      Correspondence wrong = seen(camera, random.direction(), 0, random);
      wrong.x_px = 640 * random.uniform(), wrong.y_px = 480 * random.uniform();
      points.push_back(wrong);
    }
    const PoseStatus status = find_camera_pose(points, known(camera)).status;
    EXPECT_TRUE(status == PoseStatus::kCollinear || status == PoseStatus::kNoConsensus)
        << int(status) << " " << length << " " << find_camera_pose(points, known(camera)).inliers;
  }
}

TEST(CameraPose, PlanarPointsGiveTheCameraOrSayThatThereAreTwo) {
  Random random(5);
  int ambiguous = 0, found = 0;
  for (const double distance : {3.0, 10.0, 600.0}) {
    for (int trial = 0; trial < 20; ++trial) {
      const HeadCamera camera = camera_at(distance, 300 * distance / 2, 0.9 * random.direction());
      std::vector<Correspondence> points;
      for (int i = 0; i < 40; ++i) {
        points.push_back(seen(camera, {2 * random.uniform() - 1, -1, 2 * random.uniform() - 1}, 0.5, random));
      }
      const CameraPose pose = find_camera_pose(points, known(camera));
      ambiguous += pose.status == PoseStatus::kAmbiguous;
      found += pose.status == PoseStatus::kFound;
      if (pose.status == PoseStatus::kFound) {
        EXPECT_LT(rotation_error(pose, camera),
                  5 * std::sqrt(pose.covariance[0] + pose.covariance[8] + pose.covariance[16]))
            << distance << " " << trial;
      }
    }
  }
  EXPECT_GE(found, 30);
  EXPECT_GE(ambiguous, 3);
  EXPECT_EQ(found + ambiguous, 60);
}

TEST(CameraPose, AMirroredPictureOrAHeadBehindTheCameraIsAStatus) {
  Random random(6);
  for (int trial = 0; trial < 10; ++trial) {
    const HeadCamera front = camera_at(6, 900, 0.5 * random.direction());
    std::vector<Correspondence> points = head_points(front, 100, 0.5, random);
    for (Correspondence& p : points) p.x_px = 640 - p.x_px;
    EXPECT_EQ(find_camera_pose(points, known(front)).status, PoseStatus::kMirrored)
        << trial << " " << find_camera_pose(points, known(front)).inliers;
    HeadCamera behind = front;
    behind.head_to_camera.translation.z = -6;
    for (Correspondence& p : points) p = seen(behind, p.point_dm, 0.5, random);
    EXPECT_EQ(find_camera_pose(points, known(front)).status, PoseStatus::kMirrored)
        << trial << " " << find_camera_pose(points, known(front)).inliers;
  }
}

TEST(CameraPose, TheHeadIsNeverBehindTheCamera) {
  Random random(7);
  for (int trial = 0; trial < 200; ++trial) {
    const HeadCamera camera = camera_at(1 + 5 * random.uniform(), 400, 3 * random.direction());
    std::vector<Correspondence> points;
    for (int i = 0; i < 4 + trial % 20; ++i) points.push_back(seen(camera, random.direction(), 2, random));
    spoil(points, random.uniform(), random);
    const CameraPose pose = find_camera_pose(points, prior_of(camera, 1, 0.5 * (trial % 2)));
    if (pose.status > PoseStatus::kAmbiguous) continue;
    for (size_t i = 0; i < points.size(); ++i) {
      if (pose.is_inlier[i]) {
        EXPECT_GT((pose.camera.head_to_camera * points[i].point_dm).z, 0);
      }
    }
  }
}

TEST(CameraPose, NoiseIsNoConsensus) {
  Random random(8);
  for (const size_t count : {8, 20, 100, 1000}) {
    for (int trial = 0; trial < 5; ++trial) {
      const HeadCamera camera = camera_at(6, 900, {});
      std::vector<Correspondence> points = head_points(camera, count, 1, random);
      spoil(points, 1, random);
      EXPECT_EQ(find_camera_pose(points, known(camera)).status, PoseStatus::kNoConsensus) << count;
    }
  }
}

TEST(CameraPose, FocalLengthsFromThirdAHeadToThirtyAreFoundOrHeldByThePrior) {
  Random random(9);
  for (const double distance : {1.15, 1.3, 2.0, 4.0, 10.0, 60.0}) {
    for (int trial = 0; trial < 10; ++trial) {
      HeadCamera camera = camera_at(distance, 1, 0.4 * random.direction());
      camera.head_to_camera.translation = {0.02, -0.03, distance};
      camera.focal_px = 200 * (distance - 0.9) / 2;  // some 100 to 200 pixels of head
      std::vector<Correspondence> points = head_points(camera, 300, 0.5, random);
      spoil(points, 0.3, random);
      const double factor = std::exp(0.4 * (2 * random.uniform() - 1));
      const CameraPose pose = find_camera_pose(points, prior_of(camera, factor, 0.4));
      ASSERT_EQ(pose.status, PoseStatus::kFound) << distance << " " << trial;
      const double off = std::log(pose.camera.focal_px / camera.focal_px), sigma = std::sqrt(pose.covariance[48]);
      EXPECT_LT(std::abs(off), 4.5 * sigma) << distance;
      EXPECT_LE(sigma, 0.4 + 1e-9);
      EXPECT_LT(rotation_error(pose, camera), 0.05) << distance;
      if (distance <= 4) {
        EXPECT_LT(sigma, 0.1);
      }
    }
  }
}

TEST(CameraPose, WithoutPerspectiveTheFocalLengthIsThePriors) {
  Random random(10);
  const HeadCamera camera = camera_at(1e5, 1e7, {0.2, -0.3, 0.1});
  const CameraPose pose = find_camera_pose(head_points(camera, 200, 0.5, random), {700, 0.3, 320, 240});
  ASSERT_EQ(pose.status, PoseStatus::kFound);
  EXPECT_GT(pose.camera.focal_px, 700);
  EXPECT_LT(pose.camera.focal_px, 700 * 40);  // perspective that is not there weighs against the prior
  EXPECT_TRUE(std::isfinite(pose.covariance[48]));
}

TEST(CameraPose, TheCovarianceIsThatOfTheErrors) {
  Random random(11);
  for (const double sigma : {0.0, 0.1}) {
    const int trials = 800, unknowns = sigma > 0 ? 7 : 6;
    double squares[7] = {}, variances[7] = {};
    for (int trial = 0; trial < trials; ++trial) {
      const HeadCamera camera = camera_at(5, 700, {0.2, 0.3, 0.1});
      // The prior is part of what is random.
      CameraPoseOptions options = prior_of(camera, std::exp(sigma * random.normal()), sigma);
      const CameraPose pose = find_camera_pose(head_points(camera, 60, 1, random), options);
      ASSERT_EQ(pose.status, PoseStatus::kFound);
      const Vec3 w = maq::head::log_rotation(camera.head_to_camera.rotation *
                                             maq::transposed(pose.camera.head_to_camera.rotation));
      const Vec3 t = camera.head_to_camera.translation - pose.camera.head_to_camera.translation;
      const double off[7] = {w.x, w.y, w.z, t.x, t.y, t.z, std::log(camera.focal_px / pose.camera.focal_px)};
      for (int i = 0; i < unknowns; ++i) {
        squares[i] += off[i] * off[i];
        variances[i] += pose.covariance[size_t(8 * i)];
      }
    }
    for (int i = 0; i < unknowns; ++i) EXPECT_NEAR(squares[i] / variances[i], 1, 0.25) << i << " " << sigma;
  }
}

TEST(CameraPose, UnusableCorrespondencesAreLeftOutAndCounted) {
  Random random(12);
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  const HeadCamera camera = camera_at(6, 900, {0.1, 0.2, 0.3});
  std::vector<Correspondence> points = head_points(camera, 42, 0, random);
  points[0].x_px = nan, points[1].y_px = infinite, points[2].point_dm.z = nan, points[3].weight = 0;
  points[4].weight = -1, points[5].weight = nan, points[6].sigma_px = 0, points[7].sigma_px = nan;
  points[8].sigma_px = -2, points[9].x_px = -1e300, points[10].weight = infinite, points[11].sigma_px = infinite;
  CameraPose pose = find_camera_pose(points, known(camera));
  ASSERT_EQ(pose.status, PoseStatus::kFound);
  EXPECT_EQ(pose.unusable, 12u);
  EXPECT_EQ(pose.inliers, 30u);
  EXPECT_FALSE(pose.is_inlier[3]);
  EXPECT_TRUE(pose.is_inlier[12]);
  EXPECT_LT(rotation_error(pose, camera), 1e-8);
  points.resize(15);
  pose = find_camera_pose(points, known(camera));
  EXPECT_EQ(pose.status, PoseStatus::kTooFewPoints);
  EXPECT_EQ(pose.unusable, 12u);
  EXPECT_EQ(find_camera_pose({}, known(camera)).status, PoseStatus::kTooFewPoints);
}

TEST(CameraPose, OptionsThatMeanNothingAreRefusedInASentence) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const CameraPoseOptions& options :
       {CameraPoseOptions{nan, 0, 0, 0}, CameraPoseOptions{-1, 0, 0, 0}, CameraPoseOptions{0, 0, 0, 0},
        CameraPoseOptions{1, -1, 0, 0}, CameraPoseOptions{1, nan, 0, 0}, CameraPoseOptions{1, 4, 0, 0},
        CameraPoseOptions{1, 0, nan, 0}, CameraPoseOptions{1, 0, 0, 0, 2}}) {
    try {
      find_camera_pose({}, options);
      FAIL();
    } catch (const maq::Error& error) {
      EXPECT_EQ(error.status(), MAQ_ERROR_INVALID_ARGUMENT);
      EXPECT_EQ(std::string(error.what()).back(), '.');
    }
  }
}

// Gauss-Newton's matrix is the product of the residuals' derivatives, here by differences.
TEST(CameraPose, TheInformationIsThatOfFiniteDifferences) {
  using namespace maq::head;
  ScaledPose pose;
  pose.rotation = exp_rotation({0.3, -0.8, 0.5});
  pose.u_px = 20, pose.v_px = -30, pose.log_scale = std::log(100.0), pose.log_focal = std::log(250.0);
  const Vec3 p = {0.4, -0.7, 0.9};
  const auto project = [&](const double* d) {
    const Vec3 q = exp_rotation({d[0], d[1], d[2]}) * (pose.rotation * p);
    const double s = std::exp(pose.log_scale + d[5]), w = 1 + q.z * s / std::exp(pose.log_focal + d[6]);
    return std::pair((pose.u_px + d[3] + s * q.x) / w, (pose.v_px + d[4] + s * q.y) / w);
  };
  double by[7][2];
  for (int i = 0; i < 7; ++i) {
    double up[7] = {}, down[7] = {};
    up[i] = 1e-5, down[i] = -1e-5;
    by[i][0] = (project(up).first - project(down).first) / 2e-5;
    by[i][1] = (project(up).second - project(down).second) / 2e-5;
  }
  const double zero[7] = {};
  const std::vector<PosePoint> points = {{p, project(zero).first, project(zero).second, 2, 3}};
  const size_t chosen[1] = {0};
  PoseInformation information;
  refine_pose(pose, points, chosen, 1, {pose.log_focal, 0.5}, INFINITY, 0, &information);
  for (int r = 0; r < 7; ++r) {
    for (int c = 0; c <= r; ++c) {
      const double expected = (by[r][0] * by[c][0] + by[r][1] * by[c][1]) * 3 / 4 + (c == 6 ? 4 : 0);
      EXPECT_NEAR(information[r][c], expected, 1e-6 * (1 + std::abs(expected))) << r << " " << c;
    }
  }
}

TEST(CameraPose, ARefinedPoseIsAMinimumOfItsCostWithTheFocalLengthsPrior) {
  using namespace maq::head;
  Random random(14);
  const HeadCamera camera = camera_at(4, 500, {0.2, 0.3, 0.1});
  std::vector<PosePoint> points;
  std::vector<size_t> chosen;
  for (const Correspondence& p : head_points(camera, 30, 2, random)) {
    chosen.push_back(points.size());
    points.push_back({p.point_dm, p.x_px - 320, p.y_px - 240, p.sigma_px, 1});
  }
  const FocalPrior prior = {std::log(800.0), 0.1};
  for (const double limit : {9.0, double(INFINITY)}) {
    ScaledPose pose;
    pose.rotation = camera.head_to_camera.rotation;
    pose.log_scale = std::log(125.0), pose.log_focal = std::log(650.0);
    const double cost = refine_pose(pose, points, chosen.data(), 30, prior, limit, 50);
    for (int i = 0; i < 14; ++i) {
      const double d = i % 2 == 0 ? 1e-4 : -1e-4;
      ScaledPose near = pose;
      near.rotation = exp_rotation({d * (i / 2 == 0), d * (i / 2 == 1), d * (i / 2 == 2)}) * pose.rotation;
      near.u_px += 100 * d * (i / 2 == 3), near.v_px += 100 * d * (i / 2 == 4);
      near.log_scale += d * (i / 2 == 5), near.log_focal += 10 * d * (i / 2 == 6);
      EXPECT_GT(refine_pose(near, points, chosen.data(), 30, prior, limit, 0), cost) << i;
    }
    EXPECT_GT(pose.log_focal, std::log(550.0));  // between what the points say and the prior
    EXPECT_LT(pose.log_focal, std::log(790.0));
  }
}

}  // namespace
