#include "body/fit/body_fitter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/math/small_solve.h"

namespace maq::body {
namespace {

constexpr size_t kMinPoints = 24;
constexpr double kMinInliers = 0.4, kMinWarmInliers = 0.6;
constexpr double kFirstDamping = 1e-3, kMaxDamping = 1e8, kMinDamping = 1e-7;
constexpr double kSmallDecrease = 2e-4;  // of the cost: the fit has converged
constexpr double kWideErrors = 3;        // the first iterations multiply robust_errors by this
constexpr double kInfinite = std::numeric_limits<double>::infinity();
// Noisy labels share more of their errors, so that they count less against the priors. Exact labels have a noise of
// 0.02, those of the shipped network 0.06.
constexpr double kUsualNoise = 0.04, kMinWeight = 0.5, kMaxWeight = 2;
constexpr double kSeenWeight = 2;  // of the points of a joint's bones that make it a seen one

}  // namespace

BodyFitter::BodyFitter(const BodyModel& model, const FitSettings& settings)
    : model_(model),
      settings_(settings),
      equations_(model),
      starts_(model),
      damped_(kMaxUnknowns * kMaxUnknowns),
      by_shape_(kMaxUnknowns * kMaxShapes) {}

double BodyFitter::improve(const FitProblem& problem, int iterations, BodyPose& pose, int& taken) {
  const size_t count = unknown_count(model_);
  std::array<double, kMaxUnknowns> step{};
  double damping = kFirstDamping, cost = equations_.linearize(problem, pose);
  for (int i = 0; i < iterations && std::isfinite(cost); ++i) {
    ++taken;
    double next_cost = kInfinite;
    BodyPose next;
    while (damping <= kMaxDamping) {
      for (size_t row = 0; row < count; ++row) {
        const double* const from = equations_.matrix().data() + row * kMaxUnknowns;
        std::copy_n(from, row + 1, damped_.data() + row * kMaxUnknowns);
        damped_[row * kMaxUnknowns + row] += damping * from[row] + 1e-12;
        step[row] = -equations_.gradient()[row];
      }
      if (solve_positive(damped_.data(), int(count), int(kMaxUnknowns), step.data(), 1)) {
        next = stepped(model_, pose, step.data(), settings_.max_shape);
        next_cost = equations_.cost(problem, next);
        if (next_cost < cost) break;
      }
      damping *= 8;
    }
    if (!(next_cost < cost)) break;
    const bool is_small = cost - next_cost < kSmallDecrease * cost;
    pose = next;
    cost = next_cost;
    damping = std::max(damping / 4, kMinDamping);
    if (is_small || i + 1 == iterations) break;
    cost = equations_.linearize(problem, pose);
  }
  return cost;
}

double BodyFitter::from_starts(const FitProblem& problem, BodyPose& pose, int& taken) {
  FitProblem wide = problem;
  wide.robust_errors *= kWideErrors;
  double best = kInfinite;
  for (const BodyPose& start : starts_.find(*problem.seen, problem.camera)) {
    BodyPose tried = start;
    tried.shape = problem.shape.mean;
    equations_.give_height(problem.camera, problem.shape.height_m, tried);
    const double cost = improve(wide, settings_.first_iterations, tried, taken);
    if (cost < best) best = cost, pose = tried;
  }
  return std::isfinite(best) ? improve(problem, settings_.iterations, pose, taken) : kInfinite;
}

void BodyFitter::describe(const FitProblem& problem, FittedBody& body) {
  std::array<double, kMaxJoints> seen{};
  PointRows rows;
  double sum = 0;
  size_t inliers = 0;
  const double limit = problem.robust_errors * problem.error_px;
  equations_.linearize(problem, body.pose);
  for (size_t i = 0; i < problem.seen->surface_count; ++i) {
    const Observation& observation = problem.seen->points[i];
    for (size_t k = 0; k < observation.point.joint_count; ++k) {
      seen[observation.point.joints[k]] += observation.point.weights[k];
    }
    const Projection at = equations_.rows_of(problem, body.pose, observation.point, rows);
    if (!at.is_shown) continue;
    const double dx = at.at.x - observation.at.x, dy = at.at.y - observation.at.y, square = dx * dx + dy * dy;
    if (square < limit * limit) ++inliers, sum += square;
  }
  body.inlier_fraction = double(inliers) / double(problem.seen->surface_count);
  body.error_px = inliers == 0 ? 0 : std::sqrt(sum / double(inliers));
  body.noise = body.error_px / problem.seen->size_px;
  for (size_t j = 0; j < model_.joints.size(); ++j) body.seen_joints |= seen[j] >= kSeenWeight ? 1u << j : 0u;
}

bool BodyFitter::find_size_shape(const FitProblem& problem, FittedBody& body) {
  const size_t count = unknown_count(model_), shapes = model_.shape_count;
  for (size_t row = 0; row < count; ++row) {
    std::copy_n(equations_.matrix().data() + row * kMaxUnknowns, row + 1, damped_.data() + row * kMaxUnknowns);
    damped_[row * kMaxUnknowns + row] += 1e-12;
  }
  std::fill(by_shape_.begin(), by_shape_.end(), 0.0);
  for (size_t s = 0; s < shapes; ++s) {
    // Frames share their errors, so earlier ones do not count: only the prior of people does.
    const size_t row = shape_unknown(model_) + s;
    damped_[row * kMaxUnknowns + row] += 1 - problem.shape.precision;
    by_shape_[row * shapes + s] = 1;
  }
  if (!solve_positive(damped_.data(), int(count), int(kMaxUnknowns), by_shape_.data(), int(shapes))) return false;
  FittedShape fitted;
  for (size_t a = 0; a < shapes; ++a) {
    for (size_t b = 0; b < shapes; ++b) {
      fitted.covariance[a * kMaxShapes + b] = by_shape_[(shape_unknown(model_) + a) * shapes + b];
    }
  }
  const double usual = std::min(1.0, settings_.independent_points / double(problem.seen->points.size()));
  fitted.image_weight = problem.data_weight / usual;
  fitted.shape = body.pose.shape;
  fitted.prior_mean = problem.shape.mean;
  fitted.prior_precision = problem.shape.precision;
  return find_shape_for_sizes(shapes, fitted, body.size_shape);
}

FittedBody BodyFitter::fit(const Observations& seen, const BodyCamera& camera, const BodyPose* before,
                           const ShapePrior& shape, double noise) {
  FittedBody body;
  body.pose = mean_pose(model_);
  if (seen.surface_count < kMinPoints || !(seen.size_px > 0)) return body;
  FitProblem problem;
  problem.seen = &seen;
  problem.camera = camera;
  problem.error_px = std::max(settings_.error_of_size * seen.size_px, 0.5);
  problem.robust_errors = settings_.robust_errors;
  const auto weigh = [&](double by_noise) {
    const double ratio = kUsualNoise / std::max(by_noise, 1e-3);
    const double weight = std::clamp(ratio * ratio, kMinWeight, kMaxWeight);
    problem.data_weight = std::min(1.0, weight * settings_.independent_points / double(seen.points.size()));
  };
  weigh(noise > 0 ? noise : kUsualNoise);
  problem.shape = shape;
  double cost = kInfinite;
  if (before != nullptr && is_finite(*before, model_.joints.size())) {
    problem.before = before;
    problem.before_precision = settings_.frame_precision;
    body.pose = *before;
    equations_.give_height(camera, shape.height_m, body.pose);
    cost = improve(problem, settings_.warm_iterations, body.pose, body.iterations);
    if (std::isfinite(cost) && equations_.inlier_fraction() < kMinWarmInliers) cost = kInfinite;
    problem.before = nullptr;  // what follows is not near it
    problem.before_precision = 0;
  }
  if (!std::isfinite(cost)) cost = from_starts(problem, body.pose, body.iterations);
  if (std::isfinite(cost)) describe(problem, body);
  if (std::isfinite(cost) && !(noise > 0)) {
    weigh(body.noise);
    cost = improve(problem, settings_.noise_iterations, body.pose, body.iterations);
    describe(problem, body);
  }
  const bool is_fitted = std::isfinite(cost) && body.inlier_fraction >= kMinInliers;
  body.status = is_fitted && find_size_shape(problem, body) ? FitStatus::kFitted : FitStatus::kUnreliable;
  if (body.status != FitStatus::kFitted) body.pose = mean_pose(model_);
  return body;
}

}  // namespace maq::body
