#include "body/model/body_model.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/math/small_solve.h"

namespace maq::body {
namespace {

constexpr double kMaxReach_m = 4, kMaxAngle_rad = 6;
constexpr size_t kMaxJointName = 32;

bool is_near(Vec3 p) { return is_finite(p) && length(p) <= kMaxReach_m; }

bool is_near(const Vec3& rest, const ShapeVectors& basis) {
  return is_near(rest) && std::all_of(basis.begin(), basis.end(), [](Vec3 v) { return is_near(v); });
}

bool is_sound(const BodyPoint& point, size_t joints) {
  double sum = 0;
  for (size_t k = 0; k < kWeights; ++k) {
    if (point.joints[k] >= joints || !(point.weights[k] >= 0)) return false;
    sum += point.weights[k];
  }
  return std::abs(sum - 1) < 1e-6 && is_near(point.rest, point.basis);
}

// So that names need no escapes in files.
bool is_plain_name(const std::string& name) {
  constexpr char kPlain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.";
  return !name.empty() && name.size() <= kMaxJointName && name.find_first_not_of(kPlain) == std::string::npos;
}

std::string joints_fault(const std::vector<BodyJoint>& joints) {
  if (joints.size() < 2 || joints.size() > kMaxJoints) {
    return concatenate("it has ", joints.size(), " joints, but must have 2 to ", kMaxJoints);
  }
  for (size_t k = 0; k < joints.size(); ++k) {
    const BodyJoint& joint = joints[k];
    if (!is_plain_name(joint.name)) return "the name of a joint has other letters than A to Z, 0 to 9, _ and .";
    if (k == 0 ? joint.parent != -1 : joint.parent < 0 || joint.parent >= int(k)) {
      return concatenate("joint ", k, " has the parent ", joint.parent, ", which does not come before it");
    }
    if (!is_near(joint.rest, joint.basis)) return concatenate("joint ", k, " is not finite, or far away");
  }
  return "";
}

std::string prior_fault(const PosePrior& prior, size_t angles) {
  for (const auto* values : {&prior.mean, &prior.low, &prior.high}) {
    if (values->size() != angles) return "its prior of poses is not of its joints";
    for (const double value : *values) {
      if (!(std::abs(value) <= kMaxAngle_rad)) return "its prior of poses has angles that are not finite, or too large";
    }
  }
  for (size_t k = 0; k < angles; ++k) {
    if (!(prior.low[k] <= prior.mean[k] && prior.mean[k] <= prior.high[k])) {
      return concatenate("the mean of angle ", k, " is not within the angle's limits");
    }
  }
  if (prior.precision.size() != angles * angles) return "its prior of poses is not of its joints";
  for (size_t i = 0; i < angles; ++i) {
    for (size_t j = 0; j < i; ++j) {
      const double a = prior.precision[i * angles + j], b = prior.precision[j * angles + i];
      if (!(std::abs(a - b) <= 1e-4 * (1 + std::abs(a)))) return "the precision of its poses is not symmetric";
    }
  }
  std::vector<double> factor = prior.precision, none(angles);
  if (!solve_positive(factor.data(), int(angles), int(angles), none.data(), 1)) {
    return "the precision of its poses is not positive definite";
  }
  return "";
}

}  // namespace

int BodyModel::find_joint(const std::string& name) const {
  for (size_t k = 0; k < joints.size(); ++k) {
    if (joints[k].name == name) return int(k);
  }
  return -1;
}

std::string model_fault(const BodyModel& model) {
  if (std::string fault = joints_fault(model.joints); !fault.empty()) return fault;
  const auto is_sound_here = [&](const BodyPoint& point) { return is_sound(point, model.joints.size()); };
  if (model.vertices.size() < 3 || model.triangles.empty() || model.triangles.size() % 3 != 0) {
    return concatenate("it has ", model.vertices.size(), " vertices and ", model.triangles.size() / 3, " triangles");
  }
  if (!std::all_of(model.vertices.begin(), model.vertices.end(), is_sound_here) ||
      !std::all_of(model.keypoints.begin(), model.keypoints.end(), is_sound_here)) {
    return "one of its points is far away, or has weights of joints that it does not have or that do not sum to 1";
  }
  const auto is_vertex = [&](uint32_t index) { return index < model.vertices.size(); };
  if (!std::all_of(model.triangles.begin(), model.triangles.end(), is_vertex)) {
    return "one of its triangles has vertices that it does not have";
  }
  if (model.surface.size() != kParts * size_t(model.surface_nodes) * size_t(model.surface_nodes)) {
    return "its surface is not of its size";
  }
  for (const SurfaceNode& node : model.surface) {
    if (node.triangle == kNoTriangle) continue;
    if (3 * size_t(node.triangle) >= model.triangles.size() || !(node.fractions[2] > -1e-9)) {
      return "its surface lies on triangles that it does not have, or beside one";
    }
  }
  return prior_fault(model.prior, model.angle_count());
}

}  // namespace maq::body
