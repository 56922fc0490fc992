// Fits pose and shape of a body to what an image shows of one person (Levenberg-Marquardt: Marquardt, "An algorithm for
// least-squares estimation of nonlinear parameters", 1963).
#pragma once

#include <cstdint>
#include <vector>

#include "body/fit/fit_equations.h"
#include "body/fit/starting_pose.h"
#include "body/sizes/size_intervals.h"

namespace maq::body {

enum class FitStatus {
  kFitted = 0,
  kTooFewPixels = 1,  // too little of the person is seen to fit anything
  kUnreliable = 2     // too few of the pixels agree with the pose that was found
};

struct FittedBody {
  FitStatus status = FitStatus::kTooFewPixels;
  BodyPose pose;               // of kFitted; otherwise the mean pose
  double inlier_fraction = 0;  // of surface points: those that agree with the pose
  double error_px = 0;         // root mean square distance of the points that agree
  double noise = 0;            // error_px by Observations::size_px
  int iterations = 0;
  uint32_t seen_joints = 0;  // bit j: pixels show bones of joint j; the other joints follow the prior
  SizeShape size_shape;      // of kFitted
};

struct FitSettings {
  double error_of_size = 0.05;  // error of a pixel, by Observations::size_px
  double robust_errors = 3;
  double independent_points = 60;  // many points fraction their errors: they weigh together as much as so many
  double frame_precision = 40;     // of an angle's change from frame to frame, by radian squared
  double max_shape = 3;            // standard deviations
  int first_iterations = 6;        // of each start
  int iterations = 24;             // of the best start
  int warm_iterations = 8;
  int noise_iterations = 6;  // after the noise of the labels was measured
};

class BodyFitter {
 public:
  // `model` must outlive this. Throws MAQ_ERROR_OUT_OF_MEMORY; the functions below allocate nothing.
  explicit BodyFitter(const BodyModel& model, const FitSettings& settings = {});

  // `before`: the pose in the frame before, null without one.
  // `noise`: FittedBody::noise of earlier frames. 0: unknown, so that it is measured by a first fit.
  FittedBody fit(const Observations& seen, const BodyCamera& camera, const BodyPose* before, const ShapePrior& shape,
                 double noise = 0);

 private:
  // Improves `pose` and returns its cost; infinite without a step that can be taken.
  double improve(const FitProblem& problem, int iterations, BodyPose& pose, int& taken);
  double from_starts(const FitProblem& problem, BodyPose& pose, int& taken);
  void describe(const FitProblem& problem, FittedBody& body);
  // After describe(). False where the equations of `body.pose` are singular.
  bool find_size_shape(const FitProblem& problem, FittedBody& body);

  const BodyModel& model_;
  const FitSettings settings_;
  FitEquations equations_;
  StartingPoses starts_;
  std::vector<double> damped_, by_shape_;
};

}  // namespace maq::body
