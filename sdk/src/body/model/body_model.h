// A body that can take any shape and pose: a mesh with a skeleton, a linear space of shapes, keypoints, and a prior of
// poses. Metres; x to the person's left, y to the back, z up; the first joint (the pelvis) at the origin.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/math/vec3.h"

namespace maq::body {

inline constexpr size_t kMaxJoints = 24, kMaxShapes = 12, kWeights = 4, kKeypoints = 33, kParts = 24;
inline constexpr uint16_t kNoTriangle = 65535;

using ShapeVectors = std::array<Vec3, kMaxShapes>;

// A point that moves with the body: a vertex or a keypoint.
struct BodyPoint {
  Vec3 rest;
  ShapeVectors basis;  // change for one unit (a standard deviation) of each shape coefficient
  std::array<uint8_t, kWeights> joints{};
  std::array<double, kWeights> weights{};  // sum 1
};

struct BodyJoint {
  std::string name;
  int parent = -1;  // below its own index; -1 of the first
  Vec3 rest;
  ShapeVectors basis;
};

// A node of the surface labels: a point of a triangle.
struct SurfaceNode {
  uint16_t triangle = kNoTriangle;    // kNoTriangle: no chart reaches the node
  std::array<double, 3> fractions{};  // of the triangle's vertices, sum 1
};

// Mean, limits and precision (row by row) of the rotation vectors of all joints but the first, 3 numbers each, radians.
struct PosePrior {
  std::vector<double> mean, low, high, precision;
};

struct BodyModel {
  size_t shape_count = 0;
  std::vector<BodyJoint> joints;
  std::vector<BodyPoint> vertices;
  std::array<BodyPoint, kKeypoints> keypoints;
  std::vector<uint32_t> triangles;   // three vertices each
  int surface_nodes = 0;             // n nodes along U and along V
  std::vector<SurfaceNode> surface;  // [part - 1][U * (n - 1)][V * (n - 1)]
  PosePrior prior;

  size_t angle_count() const { return 3 * (joints.size() - 1); }
  // The index of the joint of that name; -1 without one.
  int find_joint(const std::string& name) const;
};

// The fault of a model that must not be used, as the end of a sentence; "" for a sound model.
std::string model_fault(const BodyModel& model);

}  // namespace maq::body
