// Files of bodies, read back by small readers of their own: skinned glTF and BVH.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <sstream>

#include "body/files/body_bvh.h"
#include "body/files/body_glb.h"
#include "body/files/file_axes.h"
#include "core/json/json_value.h"
#include "support/expect_error.h"
#include "support/samples/shipped_body.h"

namespace body_clips {
namespace {

using namespace maq::body;  // NOLINT
using maq::JsonValue;
using maq::Mat3;
using maq::Vec3;
using shipped_body::drawn_pose;
using shipped_body::model;

BodyClip walking_clip(int frames) {
  BodyClip clip;
  for (int k = 0; k < frames; ++k) {
    ClipPose pose{int64_t(k) * 40'000'000 + 5'000'000'000, drawn_pose(1, 0.6, 0.1 * k)};
    pose.pose.rotation[7].x += 0.1 * k;
    pose.pose.place = {0.1 * k, 0, 3};
    clip.add(4, pose);
  }
  return clip;
}

class Glb {
 public:
  explicit Glb(const std::vector<uint8_t>& bytes) : bytes_(bytes) {
    uint32_t words[5];
    std::memcpy(words, bytes.data(), sizeof words);
    EXPECT_EQ(words[0], 0x46546C67u);
    EXPECT_EQ(words[2], bytes.size());
    json_ = JsonValue::parse(std::string(bytes.begin() + 20, bytes.begin() + 20 + words[3]));
    start_ = 28 + words[3];
  }

  const JsonValue& json() const { return json_; }
  static const JsonValue& at(const JsonValue& list, size_t index) { return (*list.list())[index]; }
  static size_t size(const JsonValue& value) { return size_t(*value.number()); }
  static size_t size(const JsonValue& object, const char* key) { return size(*object.find(key)); }

  // The numbers of an accessor.
  template <class Stored>
  std::vector<double> numbers(size_t accessor) const {
    const JsonValue& of = at(*json_.find("accessors"), accessor);
    const JsonValue& view = at(*json_.find("bufferViews"), size(of, "bufferView"));
    std::vector<Stored> stored(size(view, "byteLength") / sizeof(Stored));
    std::memcpy(stored.data(), bytes_.data() + start_ + size(view, "byteOffset"), stored.size() * sizeof(Stored));
    return {stored.begin(), stored.end()};
  }

 private:
  const std::vector<uint8_t>& bytes_;
  JsonValue json_;
  size_t start_ = 0;
};

struct Transform {
  Mat3 turn = maq::kIdentity3;
  Vec3 shift;
};

Transform operator*(const Transform& a, const Transform& b) { return {a.turn * b.turn, a.turn * b.shift + a.shift}; }

Mat3 matrix_of(const double* q) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
          2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
          2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
}

std::vector<double> list_of(const JsonValue& list) {
  std::vector<double> values;
  for (const JsonValue& item : *list.list()) values.push_back(*item.number());
  return values;
}

// The vertices of the first person at a frame of the animation (-1: as the nodes have them), by the rules of glTF.
std::vector<Vec3> skinned_vertices(const Glb& glb, int frame) {
  const JsonValue &nodes = *glb.json().find("nodes"), &skin = Glb::at(*glb.json().find("skins"), 0);
  std::vector<Transform> local(nodes.list()->size()), world(local.size());
  for (size_t n = 0; n < local.size(); ++n) {
    const JsonValue& node = Glb::at(nodes, n);
    if (node.find("rotation") == nullptr) continue;
    const std::vector<double> q = list_of(*node.find("rotation")), t = list_of(*node.find("translation"));
    local[n] = {matrix_of(q.data()), {t[0], t[1], t[2]}};
  }
  if (frame >= 0) {
    const JsonValue& animation = Glb::at(*glb.json().find("animations"), 0);
    for (const JsonValue& channel : *animation.find("channels")->list()) {
      const JsonValue& sampler = Glb::at(*animation.find("samplers"), Glb::size(channel, "sampler"));
      const std::vector<double> values = glb.numbers<float>(Glb::size(sampler, "output"));
      const JsonValue& target = *channel.find("target");
      Transform& changed = local[Glb::size(target, "node")];
      if (*target.find("path")->text() == "rotation") {
        changed.turn = matrix_of(values.data() + 4 * frame);
      } else {
        const double* const v = values.data() + 3 * frame;
        changed.shift = {v[0], v[1], v[2]};
      }
    }
  }
  world = local;
  for (size_t n = 0; n < local.size(); ++n) {  // parents come before their children
    const JsonValue* const children = Glb::at(nodes, n).find("children");
    if (children == nullptr) continue;
    for (const JsonValue& child : *children->list()) world[Glb::size(child)] = world[n] * local[Glb::size(child)];
  }
  const std::vector<double> inverse = glb.numbers<float>(Glb::size(skin, "inverseBindMatrices"));
  const std::vector<double> joints = list_of(*skin.find("joints"));
  const JsonValue& primitive = Glb::at(*Glb::at(*glb.json().find("meshes"), 0).find("primitives"), 0);
  const JsonValue& attributes = *primitive.find("attributes");
  const auto position = glb.numbers<float>(Glb::size(attributes, "POSITION"));
  const auto of_joint = glb.numbers<uint8_t>(Glb::size(attributes, "JOINTS_0"));
  const auto weight = glb.numbers<uint8_t>(Glb::size(attributes, "WEIGHTS_0"));
  std::vector<Vec3> made;
  for (size_t i = 0; i < position.size() / 3; ++i) {
    const Vec3 p{position[3 * i], position[3 * i + 1], position[3 * i + 2]};
    Vec3 sum;
    for (size_t k = 0; k < 4; ++k) {
      const auto joint = size_t(of_joint[4 * i + k]);
      const double* const m = inverse.data() + 16 * joint;
      const Vec3 bound = p + Vec3{m[12], m[13], m[14]};
      const Transform& at = world[size_t(joints[joint])];
      sum = sum + weight[4 * i + k] / 255 * (at.turn * bound + at.shift);
    }
    made.push_back(sum);
  }
  return made;
}

void expect_vertices(const std::vector<Vec3>& found, const BodyPose& pose, const char* what) {
  const BodyBones bones = bones_of(model(), pose);
  ASSERT_EQ(found.size(), model().vertices.size());
  for (size_t i = 0; i < found.size(); i += 31) {
    const Vec3 in_camera = posed(model(), bones, model().vertices[i]) + pose.place;
    EXPECT_LT(length(found[i] - kCameraToFile * in_camera), 1e-4) << what << " " << i;
  }
}

TEST(BodyClips, AGlbHasTheSkinnedVerticesOfEachFrame) {
  const BodyClip clip = walking_clip(5);
  const auto people = clip.people();
  const std::vector<uint8_t> bytes = people_as_glb(model(), people);
  const Glb glb(bytes);
  for (int frame = -1; frame < 5; ++frame) {
    BodyPose pose = people[0]->poses[size_t(std::max(frame, 0))].pose;
    pose.shape = people[0]->shape();
    expect_vertices(skinned_vertices(glb, frame), pose, "frame");
  }
  const JsonValue& animation = Glb::at(*glb.json().find("animations"), 0);
  EXPECT_EQ(animation.find("channels")->list()->size(), 20u);
  const auto times = glb.numbers<float>(Glb::size(Glb::at(*animation.find("samplers"), 0), "input"));
  EXPECT_EQ(times.front(), 0);
  EXPECT_NEAR(times.back(), 0.16, 1e-6);
}

TEST(BodyClips, APhotoIsAStaticGlb) {
  BodyClip clip;
  ClipPose pose{0, drawn_pose(3, 0.7, 1)};
  pose.pose.place = {0, 0, 4};
  clip.add(0, pose);
  const std::vector<uint8_t> bytes = people_as_glb(model(), clip.people());
  const Glb glb(bytes);
  EXPECT_EQ(glb.json().find("animations"), nullptr);
  expect_vertices(skinned_vertices(glb, -1), pose.pose, "photo");
}

TEST(BodyClips, PeopleAreSortedByTheirFramesAndTimesThatDoNotGoOnAreLeftOut) {
  BodyClip clip = walking_clip(3);
  ClipPose pose{5'000'000'000, drawn_pose(2, 0.5, 0)};
  pose.pose.place = {1, 0, 4};
  clip.add(4, pose);
  EXPECT_EQ(clip.people().size(), 1u);
  EXPECT_EQ(clip.people()[0]->poses.size(), 3u);
  for (int k = 0; k < 6; ++k, pose.timestamp_ns += 1'000) clip.add(9, pose);
  clip.add(0, pose);
  clip.add(0, pose);
  ASSERT_EQ(clip.people().size(), 4u);
  EXPECT_EQ(clip.people()[0]->id, 9);
  const std::vector<uint8_t> bytes = people_as_glb(model(), clip.people());
  EXPECT_EQ(Glb(bytes).json().find("skins")->list()->size(), 4u);
  for (int k = 0; k < 996; ++k) clip.add(0, pose);
  expect_error(MAQ_ERROR_UNSUPPORTED, "at most 1000", [&] { clip.add(0, pose); });
}

// Reads a BVH file and places its joints; centimetres, file axes.
class Bvh {
 public:
  explicit Bvh(const std::string& text) : text_(text) {
    std::string word;
    while (text_ >> word && word != "MOTION") {
      if (word == "ROOT" || word == "JOINT") {
        Joint joint;
        joint.parent = open_.empty() ? -1 : open_.back();
        text_ >> joint.name;
        open_.push_back(int(joints.size()));
        joints.push_back(joint);
      } else if (word == "End") {
        text_ >> word;
        open_.push_back(-2);
      } else if (word == "OFFSET") {
        Vec3 offset;
        text_ >> offset.x >> offset.y >> offset.z;
        if (open_.back() >= 0) joints[size_t(open_.back())].offset = offset;
        if (open_.back() == -2) ends += length(offset) > 2 ? 1 : 0;
      } else if (word == "CHANNELS") {
        text_ >> word;
        channels += std::stoi(word);
      } else if (word == "}") {
        open_.pop_back();
      }
    }
    text_ >> word >> frames >> word >> word >> frame_s;
    double value = 0;
    while (text_ >> value) motion.push_back(value);
  }

  struct Joint {
    std::string name;
    int parent = -1;
    Vec3 offset;
  };

  std::vector<Vec3> places(size_t frame) const {
    const double* at = motion.data() + frame * size_t(channels);
    std::vector<Mat3> turn;
    std::vector<Vec3> place;
    const Vec3 root = {at[0], at[1], at[2]};
    at += 3;
    for (const Joint& joint : joints) {
      constexpr double kRadians = 0.017453292519943295;
      const Mat3 own = maq::exp_rotation({0, 0, kRadians * at[0]}) * maq::exp_rotation({kRadians * at[1], 0, 0}) *
                       maq::exp_rotation({0, kRadians * at[2], 0});
      at += 3;
      const auto parent = size_t(joint.parent);
      turn.push_back(joint.parent < 0 ? own : turn[parent] * own);
      place.push_back(joint.parent < 0 ? root + joint.offset : place[parent] + turn[parent] * joint.offset);
    }
    return place;
  }

  std::vector<Joint> joints;
  int channels = 0, frames = 0, ends = 0;
  double frame_s = 0;
  std::vector<double> motion;

 private:
  std::istringstream text_;
  std::vector<int> open_;
};

TEST(BodyClips, ABvhReadBackPlacesTheJointsOfEachFrame) {
  const BodyClip clip = walking_clip(6);
  const ClipPerson& person = *clip.people()[0];
  const Bvh bvh(person_as_bvh(model(), person));
  ASSERT_EQ(bvh.joints.size(), 19u);
  EXPECT_EQ(bvh.channels, 3 + 3 * 19);
  EXPECT_EQ(bvh.ends, 5);  // head, hands and feet
  EXPECT_EQ(bvh.frames, 6);
  EXPECT_NEAR(bvh.frame_s, 0.04, 1e-9);
  ASSERT_EQ(bvh.motion.size(), 6u * 60);
  for (size_t frame = 0; frame < 6; ++frame) {
    BodyPose pose = person.poses[frame].pose;
    pose.shape = person.shape();
    const BodyBones bones = bones_of(model(), pose);
    const std::vector<Vec3> places = bvh.places(frame);
    for (size_t k = 0; k < places.size(); ++k) {
      const auto joint = size_t(model().find_joint(bvh.joints[k].name));
      const Vec3 expected = 100 * (kCameraToFile * (bones.place[joint] + pose.place));
      EXPECT_LT(length(places[k] - expected), 0.05) << frame << " " << bvh.joints[k].name;  // cm
    }
  }
}

TEST(BodyClips, ABvhOfUnevenFramesHasAnEvenRateAndAPhotoOneFrame) {
  BodyClip clip = walking_clip(2);
  ClipPose pose{5'400'000'000, drawn_pose(1, 0.6, 0.2)};
  pose.pose.place = {1, 0, 3};
  clip.add(4, pose);
  const Bvh bvh(person_as_bvh(model(), *clip.people()[0]));
  EXPECT_EQ(bvh.frames, 3);
  EXPECT_NEAR(bvh.frame_s, 0.2, 1e-9);
  EXPECT_NEAR(bvh.places(1)[0].x, 100 * (0.1 + 0.9 * (0.2 - 0.04) / 0.36), 0.05);
  const Bvh photo(person_as_bvh(model(), *walking_clip(1).people()[0]));
  EXPECT_EQ(photo.frames, 1);
}

TEST(BodyClips, WithoutIntrinsicsThePlaceIsThatOfAnAssumedLens) {
  const Vec3 place = place_in_metres({}, {319.5, 239.5, std::log(256.0)}, 640, 480);
  EXPECT_NEAR(place.x, 0, 1e-9);
  EXPECT_NEAR(place.y, 0, 1e-9);
  EXPECT_NEAR(place.z, 1.2 * 640 / 256, 1e-9);
}

TEST(BodyClips, RotationsOfHalfATurnHaveQuaternions) {
  for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 0.6, 0.8}}) {
    const Mat3 turn = maq::exp_rotation(3.14159265358979 * axis);
    const Quaternion q = quaternion_of(turn);
    const Mat3 again = matrix_of(q.data());
    for (size_t i = 0; i < 9; ++i) EXPECT_NEAR(again[i], turn[i], 1e-9);
  }
}

}  // namespace
}  // namespace body_clips
