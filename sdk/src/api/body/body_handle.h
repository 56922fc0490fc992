#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "api/handle.h"
#include "body/files/body_clip.h"
#include "body/fit/people_fitter.h"
#include "body/pose/joint_angles.h"
#include "body/sizes/size_intervals.h"
#include "maquette/body.h"

namespace maq {

// The default bundle.
inline constexpr char kBodyBundle[] = "body";

// One person of a result, with the numbers that the app reads.
struct BodyOfPerson {
  int64_t id = 0;
  body::FittedBody fitted;
  Vec3 place_m;         // of the pelvis, for files
  double height_m = 0;  // of the input; 0: unknown
  maq_body_person shown{};
  std::vector<float> shape, joint_rotations, joints_m, keypoints_m, vertices_m;
};

}  // namespace maq

struct maq_body_result : maq::HandleOf<maq::HandleKind::kBodyResult> {
  std::shared_ptr<const maq::body::BodyModel> model;
  std::shared_ptr<const maq::body::BodySizes> sizes;
  std::vector<maq::BodyOfPerson> people;  // the first `count` are the result's; all keep their memory
  size_t count = 0;
  int64_t timestamp_ns = 0;
  maq::BoundedPool<maq_body_result>::Deleter deleter;
};

struct maq_body : maq::HandleOf<maq::HandleKind::kBody> {
  maq_body(std::shared_ptr<const maq::body::BodyModel> of, size_t pool_size);
  std::shared_ptr<const maq::body::BodyModel> model;
  std::shared_ptr<const maq::body::BodySizes> sizes;
  maq::body::AngleJoints angle_joints;
  maq::body::PeopleFitter fitter;
  std::vector<const char*> joint_names;
  std::vector<int32_t> joint_parents;
  maq::BoundedPool<maq_body_result> results;
};

struct maq_body_clip : maq::HandleOf<maq::HandleKind::kBodyClip> {
  explicit maq_body_clip(std::shared_ptr<const maq::body::BodyModel> of) : model(std::move(of)) {}
  std::shared_ptr<const maq::body::BodyModel> model;
  maq::body::BodyClip clip;
};
