// The body that is shipped, poses of it, and pictures of its surface.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "body/fit/observations.h"
#include "body/model/body_file.h"
#include "body/pose/body_bones.h"
#include "support/temp_folder.h"

namespace shipped_body {

inline const maq::body::BodyModel& model() {
  static const auto read = [] {
    const std::string bytes = read_text(std::string(MAQ_TEST_MODELS) + "/body/body.maqb");
    return maq::body::read_body(bytes.data(), bytes.size(), "body.maqb");
  }();
  return read;
}

// A pose that people take: `spread` of 1 has a large part of the prior's spread.
inline maq::body::BodyPose drawn_pose(uint32_t seed, double spread, double yaw_rad) {
  using namespace maq::body;  // NOLINT
  std::mt19937 random(seed);
  const auto number = [&] { return double(random()) / double(std::mt19937::max()) * 2 - 1; };
  const BodyModel& body = model();
  BodyPose pose = mean_pose(body);
  for (size_t j = 1; j < body.joints.size(); ++j) {
    for (double* const part : {&pose.rotation[j].x, &pose.rotation[j].y, &pose.rotation[j].z}) {
      const size_t k = 3 * (j - 1) + size_t(part - &pose.rotation[j].x);
      const double deviation = 1 / std::sqrt(body.prior.precision[k * body.angle_count() + k]);
      *part = std::clamp(*part + spread * deviation * number(), body.prior.low[k], body.prior.high[k]);
    }
  }
  for (size_t s = 0; s < body.shape_count; ++s) pose.shape[s] = spread * number();
  pose.orientation = kFacing * maq::exp_rotation({0.1 * number(), 0.1 * number(), yaw_rad});
  return pose;
}

inline maq::body::SeenPoint seen_point(const maq::body::BodyModel& body, int part, int u_255, int v_255) {
  maq::body::SeenPoint point;
  if (!surface_point(body, part, u_255 / 255.0, v_255 / 255.0, point)) point.joint_count = 0;
  return point;
}

inline maq::Vec3 place_point(const maq::body::BodyModel& body, const maq::body::BodyBones& bones,
                             const maq::body::SeenPoint& point) {
  const maq::Vec3 rest = maq::body::shaped(point.rest, point.basis, bones.shape, body.shape_count);
  maq::Vec3 at;
  for (size_t k = 0; k < point.joint_count; ++k) at = at + point.weights[k] * moved(bones, point.joints[k], rest);
  return at;
}

// The labels of a dense pose image of bodies, each point of the surface painted as a small square; the nearest wins.
class Picture {
 public:
  Picture(int width, int height)
      : width_(width), height_(height), depth_(size_t(width * height), std::numeric_limits<double>::infinity()) {
    for (auto* plane : {&part, &u, &v, &person}) plane->assign(size_t(width * height), 0);
  }

  void paint(const maq::body::BodyCamera& camera, const maq::body::BodyPose& pose, uint8_t number) {
    const maq::body::BodyModel& body = model();
    const maq::body::BodyBones bones = bones_of(body, pose);
    for (int at_part = 1; at_part <= 24; ++at_part) {
      for (int at_u = 0; at_u < 256; at_u += 3) {
        for (int at_v = 0; at_v < 256; at_v += 3) paint_point(camera, pose, bones, number, at_part, at_u, at_v);
      }
    }
  }

  maq::body::LabelImage labels() const {
    return {width_, height_, part.data(), u.data(), v.data(), person.data(), size_t(width_)};
  }

  std::vector<uint8_t> part, u, v, person;

 private:
  void paint_point(const maq::body::BodyCamera& camera, const maq::body::BodyPose& pose,
                   const maq::body::BodyBones& bones, uint8_t number, int at_part, int at_u, int at_v) {
    const maq::body::SeenPoint point = seen_point(model(), at_part, at_u, at_v);
    if (point.joint_count == 0) return;
    const maq::Vec3 place = place_point(model(), bones, point);
    const maq::body::Projection seen = project(camera, pose.place, place);
    if (!seen.is_shown) return;
    const int x = int(std::lround(seen.at.x)), y = int(std::lround(seen.at.y));
    for (int row = std::max(y - 1, 0); row <= std::min(y + 1, height_ - 1); ++row) {
      for (int column = std::max(x - 1, 0); column <= std::min(x + 1, width_ - 1); ++column) {
        // A square hides what is behind it, but not its neighbours on the same surface.
        const double depth = place.z + (row == y && column == x ? 0 : 0.03);
        const size_t at = size_t(row * width_ + column);
        if (depth >= depth_[at]) continue;
        depth_[at] = depth;
        part[at] = uint8_t(at_part), u[at] = uint8_t(at_u), v[at] = uint8_t(at_v), person[at] = number;
      }
    }
  }

  int width_, height_;
  std::vector<double> depth_;
};

// The mean distance of the 33 keypoints of two poses, from the first joint of each. Metres.
inline double keypoint_distance_m(const maq::body::BodyPose& a, const maq::body::BodyPose& b) {
  const maq::body::BodyModel& body = model();
  const maq::body::BodyBones of_a = bones_of(body, a), of_b = bones_of(body, b);
  double sum = 0;
  for (const maq::body::BodyPoint& point : body.keypoints) {
    sum += length(posed(body, of_a, point) - posed(body, of_b, point));
  }
  return sum / double(maq::body::kKeypoints);
}

}  // namespace shipped_body
