// The bodies of a clip, or of one photo, until they are written to a file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "body/fit/body_fitter.h"

namespace maq::body {

struct ClipPose {
  int64_t timestamp_ns = 0;
  BodyPose pose;  // its place in metres, whatever the camera
};

struct ClipPerson {
  int64_t id = 0;
  std::vector<ClipPose> poses;  // by time

  // The mean of all frames: a person has one shape.
  std::array<double, kMaxShapes> shape() const;
  double length_s() const;
};

// The place in metres. Without intrinsics the camera is taken to have a focal length of 1.2 times the longer side of
// the image, some 45 degrees, and its principal point in the middle.
Vec3 place_in_metres(const BodyCamera& camera, Vec3 place, int width_px, int height_px);

class BodyClip {
 public:
  static constexpr size_t kMaxPeople = 1000;

  // Adds a pose of the person with that id, or of a new person for id 0. Poses of a person with a time that is not
  // later than the one before are left out. Throws MAQ_ERROR_UNSUPPORTED for more than kMaxPeople.
  void add(int64_t id, const ClipPose& pose);

  // The person with the most poses is first.
  std::vector<const ClipPerson*> people() const;

 private:
  std::vector<ClipPerson> people_;
};

}  // namespace maq::body
