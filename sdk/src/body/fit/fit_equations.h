// The error of a pose against what an image shows and what is known of bodies, and its normal equations.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "body/fit/observations.h"
#include "body/pose/body_bones.h"
#include "body/sizes/body_sizes.h"

namespace maq::body {

// Unknowns in this order: 3 of the orientation (a turn in camera axes, after it), 3 of the place, 3 of the rotation
// vector of each joint but the first, then the shape.
inline constexpr size_t kPlaceUnknown = 3, kJointUnknown = 6;
inline constexpr size_t kMaxUnknowns = kJointUnknown + 3 * (kMaxJoints - 1) + kMaxShapes;

inline size_t shape_unknown(const BodyModel& model) { return kJointUnknown + model.angle_count(); }
inline size_t unknown_count(const BodyModel& model) { return shape_unknown(model) + model.shape_count; }

// A shape that is expected, with the precision of each coefficient.
struct ShapePrior {
  ShapeNumbers mean{};
  double precision = 1;
  double height_m = 0;  // of the person, known to kHeightError_m; 0: unknown
};

inline constexpr double kHeightError_m = 0.003;

struct FitProblem {
  const Observations* seen = nullptr;
  BodyCamera camera;
  double error_px = 1;       // error of an observation of weight 1
  double robust_errors = 3;  // Geman-McClure: errors beyond this many error_px count less and less
  double data_weight = 1;    // of all observations, against the priors
  ShapePrior shape;
  const BodyPose* before = nullptr;  // the pose a frame earlier
  double before_precision = 0;       // of each angle
};

// How the pixel of a point changes with each unknown that moves it.
struct PointRows {
  size_t count = 0;
  std::array<uint16_t, kMaxUnknowns> unknown;
  std::array<double, kMaxUnknowns> x, y;
};

class FitEquations {
 public:
  explicit FitEquations(const BodyModel& model);

  // The sum of squared errors, each by its standard deviation; robust for observations. Infinite for a pose that is not
  // finite or has its first joint behind the camera.
  double cost(const FitProblem& problem, const BodyPose& pose);

  // The same, and the equations of a small step: matrix() step = -gradient().
  double linearize(const FitProblem& problem, const BodyPose& pose);

  // Changes shape and place of a pose, so that it has the height and looks as before. Without effect for 0.
  void give_height(const BodyCamera& camera, double height_m, BodyPose& pose) const;

  // Rows of kMaxUnknowns; the lower triangle is set.
  const std::vector<double>& matrix() const { return matrix_; }
  const std::array<double, kMaxUnknowns>& gradient() const { return gradient_; }

  // The pixel of a point in the pose of the latest linearize(), and its rows.
  Projection rows_of(const FitProblem& problem, const BodyPose& pose, const SeenPoint& point, PointRows& rows) const;

  // Returns, for the latest cost() or linearize(), the fraction of surface points with an error below robust_errors.
  double inlier_fraction() const { return inlier_fraction_; }

 private:
  void prepare_derivatives(const BodyPose& pose);
  double add_observations(const FitProblem& problem, const BodyPose& pose, bool with_equations);
  double add_priors(const FitProblem& problem, const BodyPose& pose, bool with_equations);
  void add_to(size_t i, size_t j, double value) { matrix_[i * kMaxUnknowns + j] += value; }

  const BodyModel& model_;
  const ShapeLength height_;
  BodyBones bones_;
  std::array<uint32_t, kMaxJoints> ancestors_;             // bit k: joint k moves this joint's bones
  std::array<std::array<Vec3, 3>, kMaxJoints> turn_axes_;  // how bones turn by each number of a joint's rotation vector
  std::array<ShapeVectors, kMaxJoints> place_by_shape_;    // of a joint, less its bone's own movement
  std::vector<double> matrix_;
  std::array<double, kMaxUnknowns> gradient_{};
  PointRows rows_;
  double inlier_fraction_ = 0;
};

// The pose after a step of the unknowns, with its shape within `max_shape` standard deviations.
BodyPose stepped(const BodyModel& model, const BodyPose& pose, const double* step, double max_shape);

}  // namespace maq::body
