#include "body/fit/fit_equations.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maq::body {
namespace {

constexpr double kLimitPrecision = 100;  // of an angle beyond its limit, by radian squared
constexpr double kHiddenCost = 1;        // of a point behind the camera, by the largest cost of an observation
constexpr double kImpossible = std::numeric_limits<double>::infinity();

Vec3 rotation_row(const Mat3& m, Vec3 a) {
  // a^T m
  return {a.x * m[0] + a.y * m[3] + a.z * m[6], a.x * m[1] + a.y * m[4] + a.z * m[7],
          a.x * m[2] + a.y * m[5] + a.z * m[8]};
}

Vec3 column(const Mat3& m, size_t k) { return {m[k], m[3 + k], m[6 + k]}; }

double number(Vec3 v, size_t axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

FitEquations::FitEquations(const BodyModel& model)
    : model_(model), height_(height_of(model)), matrix_(kMaxUnknowns * kMaxUnknowns) {
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const int parent = model.joints[j].parent;
    ancestors_[j] = (parent < 0 ? 0u : ancestors_[size_t(parent)]) | 1u << j;
  }
}

void FitEquations::prepare_derivatives(const BodyPose& pose) {
  for (size_t j = 0; j < model_.joints.size(); ++j) {
    const BodyJoint& joint = model_.joints[j];
    if (j == 0) {
      turn_axes_[0] = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    } else {
      const Mat3 turn = bones_.orientation[size_t(joint.parent)] * left_jacobian(pose.rotation[j]);
      for (size_t k = 0; k < 3; ++k) turn_axes_[j][k] = column(turn, k);
    }
    for (size_t s = 0; s < model_.shape_count; ++s) {
      // A bone takes p to R (p - rest) + place: this is what the shape changes but for p.
      Vec3 change;
      if (j > 0) {
        const auto parent = size_t(joint.parent);
        change = place_by_shape_[parent][s] + bones_.orientation[parent] * joint.basis[s];
      }
      place_by_shape_[j][s] = change - bones_.orientation[j] * joint.basis[s];
    }
  }
}

Projection FitEquations::rows_of(const FitProblem& problem, const BodyPose& pose, const SeenPoint& point,
                                 PointRows& rows) const {
  rows.count = 0;
  const Vec3 rest = shaped(point.rest, point.basis, pose.shape, model_.shape_count);
  // The part of the point that each of its joints turns, and the weight of this part.
  std::array<Vec3, kMaxJoints> carried;
  std::array<double, kMaxJoints> carried_weight;
  uint32_t movers = 0;
  Vec3 at;
  Mat3 blended{};
  for (size_t k = 0; k < point.joint_count; ++k) {
    const size_t joint = point.joints[k];
    const double weight = point.weights[k];
    const Vec3 part = weight * moved(bones_, joint, rest);
    at = at + part;
    blended = blended + weight * bones_.orientation[joint];
    for (size_t a = joint;; a = size_t(model_.joints[a].parent)) {
      const bool is_new = (movers & 1u << a) == 0;
      carried[a] = is_new ? part : carried[a] + part;
      carried_weight[a] = is_new ? weight : carried_weight[a] + weight;
      movers |= 1u << a;
      if (a == 0) break;
    }
  }
  const Projection seen = project(problem.camera, pose.place, at);
  if (!seen.is_shown) return seen;
  const auto add = [&](size_t unknown, double x, double y) {
    rows.unknown[rows.count] = uint16_t(unknown);
    rows.x[rows.count] = x;
    rows.y[rows.count++] = y;
  };
  const auto add_turn = [&](size_t joint, size_t unknown) {
    const Vec3 arm = carried[joint] - carried_weight[joint] * bones_.place[joint];
    const Vec3 x = cross(arm, seen.x_by_point), y = cross(arm, seen.y_by_point);
    for (size_t k = 0; k < 3; ++k) add(unknown + k, dot(turn_axes_[joint][k], x), dot(turn_axes_[joint][k], y));
  };
  add_turn(0, 0);
  for (size_t k = 0; k < 3; ++k) add(kPlaceUnknown + k, number(seen.x_by_place, k), number(seen.y_by_place, k));
  for (size_t j = 1; j < model_.joints.size(); ++j) {
    if ((movers & 1u << j) != 0) add_turn(j, kJointUnknown + 3 * (j - 1));
  }
  const Vec3 x_by_rest = rotation_row(blended, seen.x_by_point), y_by_rest = rotation_row(blended, seen.y_by_point);
  for (size_t s = 0; s < model_.shape_count; ++s) {
    Vec3 change;
    for (size_t k = 0; k < point.joint_count; ++k) {
      change = change + point.weights[k] * place_by_shape_[point.joints[k]][s];
    }
    add(shape_unknown(model_) + s, dot(x_by_rest, point.basis[s]) + dot(seen.x_by_point, change),
        dot(y_by_rest, point.basis[s]) + dot(seen.y_by_point, change));
  }
  return seen;
}

double FitEquations::add_observations(const FitProblem& problem, const BodyPose& pose, bool with_equations) {
  const double limit = problem.robust_errors * problem.robust_errors;
  double cost = 0;
  size_t inliers = 0;
  for (size_t i = 0; i < problem.seen->points.size(); ++i) {
    const Observation& observation = problem.seen->points[i];
    const double weight = problem.data_weight * observation.weight;
    Projection seen;
    if (with_equations) {
      seen = rows_of(problem, pose, observation.point, rows_);
    } else {
      const Vec3 rest = shaped(observation.point.rest, observation.point.basis, pose.shape, model_.shape_count);
      Vec3 at;
      for (size_t k = 0; k < observation.point.joint_count; ++k) {
        at = at + observation.point.weights[k] * moved(bones_, observation.point.joints[k], rest);
      }
      seen = project(problem.camera, pose.place, at);
    }
    if (!seen.is_shown) {
      cost += weight * limit * kHiddenCost;
      continue;
    }
    const double x = (seen.at.x - observation.at.x) / problem.error_px,
                 y = (seen.at.y - observation.at.y) / problem.error_px;
    const double square = x * x + y * y, damped = 1 / (1 + square / limit);
    cost += weight * square * damped;
    if (i < problem.seen->surface_count && square < limit) ++inliers;
    if (!with_equations) continue;
    const double slope = weight * damped * damped / (problem.error_px * problem.error_px);
    const double x_px = x * problem.error_px, y_px = y * problem.error_px;
    for (size_t a = 0; a < rows_.count; ++a) {
      const size_t row = rows_.unknown[a];
      const double by_x = slope * rows_.x[a], by_y = slope * rows_.y[a];
      gradient_[row] += by_x * x_px + by_y * y_px;
      double* const line = matrix_.data() + row * kMaxUnknowns;
      // Unknowns rise, so this is the lower triangle.
      for (size_t b = 0; b <= a; ++b) line[rows_.unknown[b]] += by_x * rows_.x[b] + by_y * rows_.y[b];
    }
  }
  const size_t surface = problem.seen->surface_count;
  inlier_fraction_ = surface == 0 ? 0 : double(inliers) / double(surface);
  return cost;
}

double FitEquations::add_priors(const FitProblem& problem, const BodyPose& pose, bool with_equations) {
  const size_t angles = model_.angle_count();
  const PosePrior& prior = model_.prior;
  std::array<double, 3 * kMaxJoints> away;
  double cost = 0;
  for (size_t i = 0; i < angles; ++i) away[i] = number(pose.rotation[1 + i / 3], i % 3) - prior.mean[i];
  for (size_t i = 0; i < angles; ++i) {
    const double* const precision = prior.precision.data() + i * angles;
    double slope = 0;
    for (size_t j = 0; j < angles; ++j) slope += precision[j] * away[j];
    cost += slope * away[i];
    const double angle = away[i] + prior.mean[i];
    const double beyond = angle > prior.high[i]  ? angle - prior.high[i]
                          : angle < prior.low[i] ? angle - prior.low[i]
                                                 : 0;
    cost += kLimitPrecision * beyond * beyond;
    const double moved = problem.before == nullptr ? 0 : angle - number(problem.before->rotation[1 + i / 3], i % 3);
    cost += problem.before_precision * moved * moved;
    if (!with_equations) continue;
    const size_t row = kJointUnknown + i;
    for (size_t j = 0; j <= i; ++j) add_to(row, kJointUnknown + j, precision[j]);
    add_to(row, row, (beyond != 0 ? kLimitPrecision : 0) + (problem.before != nullptr ? problem.before_precision : 0));
    gradient_[row] += slope + kLimitPrecision * beyond + problem.before_precision * moved;
  }
  for (size_t s = 0; s < model_.shape_count; ++s) {
    const double off = pose.shape[s] - problem.shape.mean[s];
    cost += problem.shape.precision * off * off;
    if (!with_equations) continue;
    const size_t row = shape_unknown(model_) + s;
    add_to(row, row, problem.shape.precision);
    gradient_[row] += problem.shape.precision * off;
  }
  if (!(problem.shape.height_m > 0)) return cost;
  constexpr double kPrecision = 1 / (kHeightError_m * kHeightError_m);
  const double off_m = height_.of(pose.shape) - problem.shape.height_m;
  cost += kPrecision * off_m * off_m;
  if (!with_equations) return cost;
  for (size_t s = 0; s < model_.shape_count; ++s) {
    const size_t row = shape_unknown(model_) + s;
    const double slope = kPrecision * height_.by_shape_m[s];
    for (size_t t = 0; t <= s; ++t) add_to(row, shape_unknown(model_) + t, slope * height_.by_shape_m[t]);
    gradient_[row] += slope * off_m;
  }
  return cost;
}

void FitEquations::give_height(const BodyCamera& camera, double height_m, BodyPose& pose) const {
  const double before_m = height_.of(pose.shape);
  double square = 0;
  for (const double slope : height_.by_shape_m) square += slope * slope;
  if (!(height_m > 0 && before_m > 0 && square > 0)) return;
  for (size_t s = 0; s < model_.shape_count; ++s) {
    pose.shape[s] += (height_m - before_m) * height_.by_shape_m[s] / square;
  }
  if (camera.is_perspective) {
    pose.place = (height_m / before_m) * pose.place;
  } else {
    pose.place.z -= std::log(height_m / before_m);
  }
}

double FitEquations::cost(const FitProblem& problem, const BodyPose& pose) {
  if (!is_finite(pose, model_.joints.size())) return kImpossible;
  bones_ = bones_of(model_, pose);
  if (problem.camera.is_perspective && !(pose.place.z >= kNearest_m)) return kImpossible;
  const double sum = add_observations(problem, pose, false) + add_priors(problem, pose, false);
  return std::isfinite(sum) ? sum : kImpossible;
}

double FitEquations::linearize(const FitProblem& problem, const BodyPose& pose) {
  if (!is_finite(pose, model_.joints.size())) return kImpossible;
  const size_t count = unknown_count(model_);
  for (size_t i = 0; i < count; ++i) std::fill_n(matrix_.begin() + std::ptrdiff_t(i * kMaxUnknowns), i + 1, 0.0);
  gradient_.fill(0);
  bones_ = bones_of(model_, pose);
  prepare_derivatives(pose);
  const double sum = add_observations(problem, pose, true) + add_priors(problem, pose, true);
  return std::isfinite(sum) ? sum : kImpossible;
}

BodyPose stepped(const BodyModel& model, const BodyPose& pose, const double* step, double max_shape) {
  BodyPose next = pose;
  const auto vector_at = [&](size_t at) { return Vec3{step[at], step[at + 1], step[at + 2]}; };
  next.orientation = exp_rotation(vector_at(0)) * pose.orientation;
  next.place = pose.place + vector_at(kPlaceUnknown);
  for (size_t j = 1; j < model.joints.size(); ++j) {
    next.rotation[j] = pose.rotation[j] + vector_at(kJointUnknown + 3 * (j - 1));
  }
  for (size_t s = 0; s < model.shape_count; ++s) {
    next.shape[s] = std::clamp(pose.shape[s] + step[shape_unknown(model) + s], -max_shape, max_shape);
  }
  return next;
}

}  // namespace maq::body
