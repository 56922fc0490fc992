#include "body/files/body_glb.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "body/files/file_axes.h"
#include "core/error.h"
#include "core/files/glb_writer.h"

namespace maq::body {
namespace {

void append(std::vector<float>& to, Vec3 v) {
  for (const double value : {v.x, v.y, v.z}) to.push_back(float(value) + 0.0f);  // no -0
}

void append(std::string& list, const std::string& item) { list += (list.empty() ? "" : ",") + item; }

std::string vector_text(Vec3 v) {
  std::vector<float> values;
  append(values, v);
  return glb_numbers(values.data(), 3);
}

std::string quaternion_text(const Quaternion& q) {
  const float values[] = {float(q[0]), float(q[1]), float(q[2]), float(q[3])};
  return glb_numbers(values, 4);
}

// Normals of the vertices, weighted by the areas of their triangles.
std::vector<Vec3> normals_of(const std::vector<Vec3>& vertices, const std::vector<uint32_t>& triangles) {
  std::vector<Vec3> normals(vertices.size());
  for (size_t i = 0; i + 2 < triangles.size(); i += 3) {
    const uint32_t* const corner = triangles.data() + i;
    const Vec3 normal = cross(vertices[corner[1]] - vertices[corner[0]], vertices[corner[2]] - vertices[corner[0]]);
    for (size_t k = 0; k < 3; ++k) normals[corner[k]] = normals[corner[k]] + normal;
  }
  for (Vec3& normal : normals) normal = length(normal) > 0 ? normalized(normal) : Vec3{0, 1, 0};
  return normals;
}

// The JSON's lists, to which each person adds.
struct Lists {
  std::string meshes, skins, nodes, roots, channels, samplers;
  size_t mesh_count = 0, node_count = 0, sampler_count = 0;
};

class PersonWriter {
 public:
  PersonWriter(const BodyModel& model, const ClipPerson& person, int64_t start_ns, GlbWriter& glb, Lists& lists)
      : model_(model), person_(person), start_ns_(start_ns), glb_(glb), lists_(lists), shape_(person.shape()) {
    for (const BodyJoint& joint : model.joints) {
      rest_.push_back(kBodyToFile * shaped(joint.rest, joint.basis, shape_, model.shape_count));
    }
  }

  // The mesh is beside the skeleton, not above or below it: only the skeleton moves it.
  void write(size_t number) {
    const size_t mesh_node = lists_.node_count, first_joint = mesh_node + 1;
    write_mesh();
    write_skin(first_joint);
    append(lists_.roots, concatenate(mesh_node, ',', first_joint));
    append(lists_.nodes, concatenate("{\"name\":\"person_", number + 1, "\",\"mesh\":", lists_.mesh_count,
                                     ",\"skin\":", lists_.mesh_count, '}'));
    for (size_t j = 0; j < rest_.size(); ++j) append(lists_.nodes, joint_node(j, first_joint));
    lists_.node_count = first_joint + rest_.size();
    if (person_.poses.size() > 1) write_animation(first_joint);
    ++lists_.mesh_count;
  }

 private:
  void write_mesh() {
    std::vector<Vec3> vertices;
    std::vector<float> positions, normals;
    std::vector<uint8_t> joints, weights;
    for (const BodyPoint& point : model_.vertices) {
      vertices.push_back(kBodyToFile * shaped(point.rest, point.basis, shape_, model_.shape_count));
      append(positions, vertices.back());
      for (size_t k = 0; k < kWeights; ++k) {
        const auto weight = uint8_t(std::lround(255 * point.weights[k]));
        weights.push_back(weight);
        joints.push_back(weight == 0 ? uint8_t(0) : point.joints[k]);
      }
    }
    for (const Vec3& normal : normals_of(vertices, model_.triangles)) append(normals, normal);
    const GlbTarget target = GlbTarget::kVertices;
    const size_t at_positions = glb_.add_accessor(positions, 3, GlbComponent::kFloat, target, glb_limits(positions, 3));
    const size_t at_normals = glb_.add_accessor(normals, 3, GlbComponent::kFloat, target);
    const size_t at_joints = glb_.add_accessor(joints, 4, GlbComponent::kUnsignedByte, target, "", true);
    const size_t at_weights = glb_.add_accessor(weights, 4, GlbComponent::kUnsignedByte, target);
    const size_t at_indices = glb_.add_accessor(model_.triangles, 1, GlbComponent::kUnsignedInt, GlbTarget::kIndices);
    append(lists_.meshes, concatenate("{\"name\":\"body\",\"primitives\":[{\"attributes\":{\"POSITION\":", at_positions,
                                      ",\"NORMAL\":", at_normals, ",\"JOINTS_0\":", at_joints, ",\"WEIGHTS_0\":",
                                      at_weights, "},\"indices\":", at_indices, ",\"material\":0}]}"));
  }

  void write_skin(size_t first_joint) {
    std::vector<float> inverse;  // of each joint's place at rest, column by column
    std::string joints;
    for (size_t j = 0; j < rest_.size(); ++j) {
      for (size_t column = 0; column < 3; ++column) {
        for (size_t row = 0; row < 4; ++row) inverse.push_back(row == column ? 1.0f : 0.0f);
      }
      append(inverse, -rest_[j]);
      inverse.push_back(1);
      append(joints, std::to_string(first_joint + j));
    }
    const size_t matrices = glb_.add_accessor(inverse, 16, GlbComponent::kFloat, GlbTarget::kNone);
    append(lists_.skins, concatenate("{\"inverseBindMatrices\":", matrices, ",\"skeleton\":", first_joint,
                                     ",\"joints\":[", joints, "]}"));
  }

  Vec3 translation(size_t joint, const BodyPose& pose) const {
    if (joint == 0) return kCameraToFile * pose.place;
    return rest_[joint] - rest_[size_t(model_.joints[joint].parent)];
  }

  static Mat3 rotation(size_t joint, const BodyPose& pose) {
    return joint == 0 ? orientation_in_file(pose.orientation) : local_in_file(exp_rotation(pose.rotation[joint]));
  }

  // With the first pose, so that a program without animations shows it.
  std::string joint_node(size_t joint, size_t first_joint) const {
    const BodyPose& pose = person_.poses.front().pose;
    std::string children;
    for (size_t j = joint + 1; j < rest_.size(); ++j) {
      if (model_.joints[j].parent == int(joint)) append(children, std::to_string(first_joint + j));
    }
    return concatenate("{\"name\":\"", model_.joints[joint].name,
                       "\",\"translation\":", vector_text(translation(joint, pose)),
                       ",\"rotation\":", quaternion_text(quaternion_of(rotation(joint, pose))),
                       children.empty() ? "" : ",\"children\":[" + children + ']', '}');
  }

  void write_animation(size_t first_joint) {
    std::vector<float> times, places;
    for (const ClipPose& pose : person_.poses) {
      times.push_back(float(1e-9 * double(pose.timestamp_ns - start_ns_)));
      append(places, translation(0, pose.pose));
    }
    const size_t at_times = glb_.add_accessor(times, 1, GlbComponent::kFloat, GlbTarget::kNone, glb_limits(times, 1));
    const auto add_channel = [&](size_t joint, const char* path, const std::vector<float>& values, size_t each) {
      const size_t output = glb_.add_accessor(values, each, GlbComponent::kFloat, GlbTarget::kNone);
      append(lists_.samplers, concatenate("{\"input\":", at_times, ",\"output\":", output, '}'));
      append(lists_.channels, concatenate("{\"sampler\":", lists_.sampler_count++,
                                          ",\"target\":{\"node\":", first_joint + joint, ",\"path\":\"", path, "\"}}"));
    };
    add_channel(0, "translation", places, 3);
    for (size_t j = 0; j < rest_.size(); ++j) {
      std::vector<float> turns;
      Quaternion before = {0, 0, 0, 1};
      for (const ClipPose& pose : person_.poses) {
        before = continued(before, quaternion_of(rotation(j, pose.pose)));
        turns.insert(turns.end(), before.begin(), before.end());
      }
      add_channel(j, "rotation", turns, 4);
    }
  }

  const BodyModel& model_;
  const ClipPerson& person_;
  const int64_t start_ns_;
  GlbWriter& glb_;
  Lists& lists_;
  const std::array<double, kMaxShapes> shape_;
  std::vector<Vec3> rest_;  // of the joints, file axes
};

}  // namespace

std::vector<uint8_t> people_as_glb(const BodyModel& model, const std::vector<const ClipPerson*>& people) {
  GlbWriter glb;
  Lists lists;
  int64_t start_ns = people.front()->poses.front().timestamp_ns;
  for (const ClipPerson* person : people) start_ns = std::min(start_ns, person->poses.front().timestamp_ns);
  for (size_t k = 0; k < people.size(); ++k) PersonWriter(model, *people[k], start_ns, glb, lists).write(k);
  std::string animations;
  if (!lists.channels.empty()) {
    animations = concatenate(",\"animations\":[{\"name\":\"clip\",\"channels\":[", lists.channels, "],\"samplers\":[",
                             lists.samplers, "]}]");
  }
  return glb.finish(
      concatenate(animations,
                  ",\"materials\":[{\"name\":\"body\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.62,0.57,0.52,1],"
                  "\"metallicFactor\":0,\"roughnessFactor\":0.8}}],\"meshes\":[",
                  lists.meshes, "],\"nodes\":[", lists.nodes, "],\"skins\":[", lists.skins,
                  "],\"scenes\":[{\"nodes\":[", lists.roots, "]}],\"scene\":0"));
}

}  // namespace maq::body
