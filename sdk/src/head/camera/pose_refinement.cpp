#include "head/camera/pose_refinement.h"

#include <algorithm>
#include <cmath>

#include "core/math/small_solve.h"

namespace maq::head {

namespace {

double error_of(const SeenPoint& at, const PosePoint& point) {
  if (!at.is_seen()) return INFINITY;
  const double dx = at.x_px - point.x, dy = at.y_px - point.y;
  return (dx * dx + dy * dy) / (point.sigma_px * point.sigma_px);
}

double loss_of(double error, double limit) {
  if (std::isinf(limit)) return error;
  return std::isinf(error) ? limit : error / (1 + error / limit);
}

double prior_cost(const ScaledPose& pose, const FocalPrior& prior) {
  if (!(prior.sigma > 0)) return 0;
  const double off = (pose.log_focal - prior.log_mean) / prior.sigma;
  return off * off;
}

double cost_of(const ScaledPose& pose, const std::vector<PosePoint>& points, const size_t* chosen, size_t count,
               const FocalPrior& prior, double limit) {
  const ScaledProjection projection(pose);
  double sum = prior_cost(pose, prior);
  for (size_t i = 0; i < count; ++i) {
    const PosePoint& point = points[chosen[i]];
    sum += point.weight * loss_of(error_of(projection.project(point.p), point), limit);
  }
  return sum;
}

// The equations of a step, of the lower triangle of `a`.
void accumulate(const ScaledPose& pose, const std::vector<PosePoint>& points, const size_t* chosen, size_t count,
                const FocalPrior& prior, double limit, PoseInformation& a, double* b) {
  std::fill(&a[0][0], &a[0][0] + 49, 0.0);
  std::fill(b, b + 7, 0.0);
  const ScaledProjection projection(pose);
  for (size_t i = 0; i < count; ++i) {
    const PosePoint& point = points[chosen[i]];
    const SeenPoint at = projection.project(point.p);
    const double error = error_of(at, point);
    if (std::isinf(error)) continue;
    const double robust = std::isinf(limit) ? 1 : 1 / (1 + error / limit);
    const double weight = point.weight * robust * robust / (point.sigma_px * point.sigma_px);
    const PixelJacobian jacobian = projection.jacobian(at);
    const double* const jx = jacobian.by_pose[0];
    const double* const jy = jacobian.by_pose[1];
    const double rx = weight * (point.x - at.x_px), ry = weight * (point.y - at.y_px);
    for (int r = 0; r < 7; ++r) {
      const double wx = weight * jx[r], wy = weight * jy[r];
      for (int c = 0; c <= r; ++c) a[r][c] += wx * jx[c] + wy * jy[c];
      b[r] += jx[r] * rx + jy[r] * ry;
    }
  }
  if (prior.sigma > 0) {
    a[6][6] += 1 / (prior.sigma * prior.sigma);
    b[6] += (prior.log_mean - pose.log_focal) / (prior.sigma * prior.sigma);
  }
}

}  // namespace

double squared_error(const ScaledPose& pose, const PosePoint& point) {
  return error_of(ScaledProjection(pose).project(point.p), point);
}

double refine_pose(ScaledPose& pose, const std::vector<PosePoint>& points, const size_t* chosen, size_t count,
                   const FocalPrior& prior, double limit, int rounds, PoseInformation* information) {
  const int unknowns = prior.sigma > 0 ? 7 : 6;
  double cost = cost_of(pose, points, chosen, count, prior, limit);
  double damping = 1e-4;
  PoseInformation a;
  double b[7];
  bool is_current = false;
  for (int round = 0; round < rounds && std::isfinite(cost) && damping < 1e9; ++round) {
    if (!is_current) accumulate(pose, points, chosen, count, prior, limit, a, b);
    is_current = true;
    PoseInformation damped;
    std::copy(&a[0][0], &a[0][0] + 49, &damped[0][0]);
    for (int i = 0; i < 7; ++i) damped[i][i] += damping * a[i][i];
    double step[7];
    std::copy(b, b + 7, step);
    step[6] = unknowns == 7 ? step[6] : 0;
    const bool is_solved = solve_positive(&damped[0][0], unknowns, 7, step, 1);
    if (!is_solved || !is_small_step(step)) {
      damping *= 10;
      continue;
    }
    const double turn = std::sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
    const ScaledPose next = moved(pose, step);
    const double next_cost = cost_of(next, points, chosen, count, prior, limit);
    if (!(next_cost < cost)) {
      if (turn < 1e-9) break;
      damping *= 10;
      continue;
    }
    const bool is_end = cost - next_cost < 1e-10 * (1 + cost) && turn < 1e-7;
    pose = next;
    cost = next_cost;
    damping = std::max(damping * 0.1, 1e-12);
    is_current = false;
    if (is_end) break;
  }
  if (information) accumulate(pose, points, chosen, count, prior, limit, *information, b);
  return cost;
}

}  // namespace maq::head
