#include "body/fit/starting_pose.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maq::body {
namespace {

constexpr double kTurn = 6.283185307179586;
constexpr int kYaws = 16, kPitches = 7, kRolls = 12;
constexpr double kPitchStep_rad = 0.42;
constexpr double kTiltPenalty = 0.15;    // of lying and upside-down people, who are rare
constexpr double kApartCosine = 0.7071;  // between starts

// How much the mean pose says about where a part is: limbs move, the trunk does not.
double weight_of_part(int part) {
  if (part == 1 || part == 2) return 1;       // trunk
  if (part >= 23) return 0.3;                 // head
  if (part >= 7 && part <= 10) return 0.3;    // upper legs
  if (part >= 15 && part <= 18) return 0.15;  // upper arms
  return part == 0 ? 0.0 : 0.03;
}

// Orientations of bodies, upright ones first.
std::vector<Mat3> orientations() {
  std::vector<Mat3> made;
  for (int roll = 0; roll < kRolls; ++roll) {
    for (int pitch = 0; pitch < kPitches; ++pitch) {
      const double tilt = kPitchStep_rad * (pitch % 2 == 1 ? (pitch + 1) / 2 : -pitch / 2);
      for (int yaw = 0; yaw < kYaws; ++yaw) {
        made.push_back(exp_rotation({0, 0, kTurn * roll / kRolls}) * exp_rotation({tilt, 0, 0}) * kFacing *
                       exp_rotation({0, 0, kTurn * yaw / kYaws}));
      }
    }
  }
  return made;
}

double cosine_between(const Mat3& a, const Mat3& b) {
  double trace = 0;
  for (size_t i = 0; i < 9; ++i) trace += a[i] * b[i];
  return (trace - 1) / 2;
}

}  // namespace

StartingPoses::StartingPoses(const BodyModel& model) : mean_(mean_pose(model)) {
  BodyPose pose = mean_;
  pose.orientation = kIdentity3;
  bones_ = bones_of(model, pose);
  for (const Mat3& orientation : orientations()) candidates_.push_back({orientation});
  found_.reserve(kMaxStarts);
}

const std::vector<BodyPose>& StartingPoses::find(const Observations& seen, const BodyCamera& camera) {
  found_.clear();
  // Moments of the points of the mean pose and of their pixels: all that an orientation needs.
  double total = 0;
  Vec3 mean;
  Pixel mean_px;
  const auto for_each_point = [&](auto&& use) {
    for (const Observation& observation : seen.points) {
      const double weight = weight_of_part(observation.part);
      if (weight <= 0) continue;
      Vec3 point;
      for (size_t k = 0; k < observation.point.joint_count; ++k) {
        point =
            point + observation.point.weights[k] * moved(bones_, observation.point.joints[k], observation.point.rest);
      }
      use(weight, point, observation.at);
    }
  };
  for_each_point([&](double weight, Vec3 point, Pixel at) {
    total += weight;
    mean = mean + weight * point;
    mean_px = {mean_px.x + weight * at.x, mean_px.y + weight * at.y};
  });
  if (total <= 0) return found_;
  mean = (1 / total) * mean;
  mean_px = {mean_px.x / total, mean_px.y / total};
  Mat3 spread{};
  Vec3 by_x, by_y;
  double spread_px = 0;
  for_each_point([&](double weight, Vec3 point, Pixel at) {
    const Vec3 p = point - mean;
    const double dx = at.x - mean_px.x, dy = at.y - mean_px.y;
    const double v[3] = {p.x, p.y, p.z};
    for (size_t i = 0; i < 9; ++i) spread[i] += weight * v[i / 3] * v[i % 3];
    by_x = by_x + weight * dx * p;
    by_y = by_y + weight * dy * p;
    spread_px += weight * (dx * dx + dy * dy);
  });
  if (!(spread_px > 0)) return found_;
  for (Candidate& candidate : candidates_) {
    const Mat3& r = candidate.orientation;
    const Vec3 x{r[0], r[1], r[2]}, y{r[3], r[4], r[5]};
    const double together = dot(x, by_x) + dot(y, by_y), own = dot(x, spread * x) + dot(y, spread * y);
    candidate.scale = own > 1e-9 ? together / own : 0;
    const double upright = -r[5];  // the body's z axis on the image's vertical
    candidate.error = candidate.scale > 0
                          ? (spread_px - together * candidate.scale) * (1 + kTiltPenalty * (1 - upright))
                          : std::numeric_limits<double>::infinity();
  }
  while (found_.size() < kMaxStarts) {
    const Candidate* best = nullptr;
    for (const Candidate& candidate : candidates_) {
      const auto is_near = [&](const BodyPose& pose) {
        return cosine_between(pose.orientation, candidate.orientation) > kApartCosine;
      };
      if (!(candidate.error < (best == nullptr ? std::numeric_limits<double>::infinity() : best->error))) continue;
      if (std::none_of(found_.begin(), found_.end(), is_near)) best = &candidate;
    }
    if (best == nullptr) break;
    BodyPose pose = mean_;
    pose.orientation = best->orientation;
    const Vec3 middle = best->scale * (best->orientation * mean);
    pose.place = place_of(camera, {mean_px.x - middle.x, mean_px.y - middle.y}, best->scale);
    if (camera.is_perspective) pose.place.z = std::max(pose.place.z, 1.5 * kNearest_m);
    found_.push_back(pose);
  }
  return found_;
}

}  // namespace maq::body
