#include "head/camera/pose_refinement.h"

#include <algorithm>
#include <cmath>

#include "core/math/small_solve.h"

namespace maq::head {

namespace {

constexpr double kMinDepthRatio = 1e-3;  // of the depth at the origin

struct Projection {
  Vec3 q;
  double depth_ratio, x, y;
};

class Projector {
 public:
  explicit Projector(const ScaledPose& pose)
      : pose_(pose), scale_(std::exp(pose.log_scale)), ratio_(std::exp(pose.log_scale - pose.log_focal)) {}

  Projection project(Vec3 p) const {
    const Vec3 q = pose_.rotation * p;
    const double w = 1 + q.z * ratio_;
    return {q, w, (pose_.u_px + scale_ * q.x) / w, (pose_.v_px + scale_ * q.y) / w};
  }
  double scale() const { return scale_; }
  double ratio() const { return ratio_; }

 private:
  const ScaledPose& pose_;
  double scale_, ratio_;
};

double error_of(const Projection& at, const PosePoint& point) {
  if (!(at.depth_ratio > kMinDepthRatio)) return INFINITY;
  const double dx = at.x - point.x, dy = at.y - point.y;
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
  const Projector projector(pose);
  double sum = prior_cost(pose, prior);
  for (size_t i = 0; i < count; ++i) {
    const PosePoint& point = points[chosen[i]];
    sum += point.weight * loss_of(error_of(projector.project(point.p), point), limit);
  }
  return sum;
}

// The equations of a step, of the lower triangle of `a`.
void accumulate(const ScaledPose& pose, const std::vector<PosePoint>& points, const size_t* chosen, size_t count,
                const FocalPrior& prior, double limit, PoseInformation& a, double* b) {
  std::fill(&a[0][0], &a[0][0] + 49, 0.0);
  std::fill(b, b + 7, 0.0);
  const Projector projector(pose);
  const double s = projector.scale(), k = projector.ratio();
  for (size_t i = 0; i < count; ++i) {
    const PosePoint& point = points[chosen[i]];
    const Projection at = projector.project(point.p);
    const double error = error_of(at, point);
    if (std::isinf(error)) continue;
    const double robust = std::isinf(limit) ? 1 : 1 / (1 + error / limit);
    const double weight = point.weight * robust * robust / (point.sigma_px * point.sigma_px);
    const double by_w = 1 / at.depth_ratio;
    const Vec3 q = at.q;
    // Of the pixel by q: (s, 0, -x k) and (0, s, -y k), over the depth ratio; of q by the rotation: -[q]x.
    const double xz = -at.x * k, yz = -at.y * k, deeper = (at.depth_ratio - 1) * by_w;
    const double jx[7] = {
        by_w * xz * q.y, by_w * (s * q.z - xz * q.x), by_w * -s * q.y, by_w, 0, by_w * s * q.x - at.x * deeper,
        at.x * deeper};
    const double jy[7] = {by_w * (yz * q.y - s * q.z),    by_w * -yz * q.x, by_w * s * q.x, 0, by_w,
                          by_w * s * q.y - at.y * deeper, at.y * deeper};
    const double rx = weight * (point.x - at.x), ry = weight * (point.y - at.y);
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

ScaledPose moved(const ScaledPose& pose, const double* step) {
  ScaledPose to = pose;
  to.rotation = exp_rotation({step[0], step[1], step[2]}) * pose.rotation;
  to.u_px += step[3], to.v_px += step[4];
  to.log_scale += step[5], to.log_focal += step[6];
  return to;
}

}  // namespace

double squared_error(const ScaledPose& pose, const PosePoint& point) {
  return error_of(Projector(pose).project(point.p), point);
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
    // A turn of more than a radian, or a scale of more than e^2, leaves what the equations know of.
    const double turn = std::sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
    if (!is_solved || !(turn < 1) || !(std::abs(step[5]) < 2) || !(std::abs(step[6]) < 2)) {
      damping *= 10;
      continue;
    }
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
