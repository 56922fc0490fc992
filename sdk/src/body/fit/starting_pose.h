// Where to begin a fit without an earlier frame: orientations in which the mean pose, seen from afar, lies near its
// pixels.
#pragma once

#include <array>
#include <vector>

#include "body/fit/observations.h"
#include "body/pose/body_bones.h"

namespace maq::body {

class StartingPoses {
 public:
  static constexpr size_t kMaxStarts = 3;

  explicit StartingPoses(const BodyModel& model);

  // Poses of which the best starts are first, at least 45 degrees from each other; at most kMaxStarts. Empty where the
  // pixels tell no scale: too few, or all in one place.
  const std::vector<BodyPose>& find(const Observations& seen, const BodyCamera& camera);

 private:
  struct Candidate {
    Mat3 orientation;
    double error = 0, scale = 0;
  };

  BodyPose mean_;
  BodyBones bones_;  // of the mean pose in body axes
  std::vector<Candidate> candidates_;
  std::vector<BodyPose> found_;
};

}  // namespace maq::body
