#include "head/fit/anchor_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/math/small_solve.h"

namespace maq::head {
namespace {

// How much of the codes' variance widens the limit of outliers, from the mean head to the fitted one, and how many
// steps that is worth.
struct Phase {
  double code_fraction;
  int steps;
};
constexpr Phase kPhases[] = {{1, 3}, {0.2, 3}, {0.04, 3}, {0, 100}};

struct Participant {
  size_t photo;
  AnchorTerms terms;
  ScaledPose pose;
  double log_focal_mean, log_focal_sigma;
};

class JointFit {
 public:
  JointFit(std::vector<Participant>& parts, size_t codes)
      : parts_(parts), codes_(codes), size_(parts.size() * kPoseUnknowns + codes), z_(codes) {}

  void run(int max_steps) {
    for (const Phase& phase : kPhases) {
      for (Participant& part : parts_) part.terms.set_noise(part.pose, z_.data(), phase.code_fraction);
      minimise(std::min(phase.steps, max_steps - steps_));
    }
  }

  // The covariance of the codes, from the inverse of the equations' matrix; empty if the matrix cannot be inverted.
  std::vector<float> code_covariance() {
    set_up();
    std::vector<double> inverse(size_ * codes_);
    for (size_t k = 0; k < codes_; ++k) inverse[(size_ - codes_ + k) * codes_ + k] = 1;
    if (codes_ == 0 || !solve_positive(a_.data(), int(size_), int(size_), inverse.data(), int(codes_))) return {};
    return {inverse.end() - std::ptrdiff_t(codes_ * codes_), inverse.end()};
  }

  const std::vector<double>& codes() const { return z_; }
  int steps() const { return steps_; }
  double cost() const { return cost_of(parts_poses(), z_); }

 private:
  std::vector<ScaledPose> parts_poses() const {
    std::vector<ScaledPose> poses;
    for (const Participant& part : parts_) poses.push_back(part.pose);
    return poses;
  }

  double cost_of(const std::vector<ScaledPose>& poses, const std::vector<double>& z) const {
    double sum = std::inner_product(z.begin(), z.end(), z.begin(), 0.0);
    for (size_t i = 0; i < parts_.size(); ++i) {
      sum += parts_[i].terms.cost(poses[i], z.data());
      if (!(parts_[i].log_focal_sigma > 0)) continue;
      const double off = (poses[i].log_focal - parts_[i].log_focal_mean) / parts_[i].log_focal_sigma;
      sum += off * off;
    }
    return sum;
  }

  // The equations of a step, of the lower triangle.
  void set_up() {
    a_.assign(size_ * size_, 0.0);
    b_.assign(size_, 0.0);
    const size_t local = kPoseUnknowns + codes_, first_code = size_ - codes_;
    for (size_t i = 0; i < parts_.size(); ++i) {
      Participant& part = parts_[i];
      part_a_.assign(local * local, 0.0);
      part_b_.assign(local, 0.0);
      part.terms.accumulate(part.pose, z_.data(), part_a_.data(), part_b_.data());
      const auto global = [&](size_t k) {
        return k < kPoseUnknowns ? i * kPoseUnknowns + k : first_code + k - kPoseUnknowns;
      };
      for (size_t r = 0; r < local; ++r) {
        for (size_t c = 0; c <= r; ++c) a_[global(r) * size_ + global(c)] += part_a_[r * local + c];
        b_[global(r)] += part_b_[r];
      }
      const size_t focal = i * kPoseUnknowns + kPoseUnknowns - 1;
      if (part.log_focal_sigma > 0) {
        const double inverse = 1 / (part.log_focal_sigma * part.log_focal_sigma);
        a_[focal * size_ + focal] += inverse;
        b_[focal] += inverse * (part.log_focal_mean - part.pose.log_focal);
      } else {
        hold(focal);
      }
    }
    for (size_t k = 0; k < codes_; ++k) {
      a_[(first_code + k) * size_ + first_code + k] += 1;
      b_[first_code + k] -= z_[k];
    }
  }

  // Takes an unknown out of the equations.
  void hold(size_t k) {
    for (size_t j = 0; j < k; ++j) a_[k * size_ + j] = 0;
    for (size_t j = k; j < size_; ++j) a_[j * size_ + k] = 0;
    a_[k * size_ + k] = 1;
    b_[k] = 0;
  }

  void minimise(int max_steps) {
    std::vector<ScaledPose> poses = parts_poses();
    double cost = cost_of(poses, z_), damping = 1e-3;
    bool is_current = false;
    for (int step = 0; step < max_steps && damping < 1e9; ++step) {
      if (!is_current) set_up();
      is_current = true;
      ++steps_;
      std::vector<double> factor = a_, change = b_, z = z_;
      for (size_t k = 0; k < size_; ++k) factor[k * size_ + k] *= 1 + damping;
      bool is_good = solve_positive(factor.data(), int(size_), int(size_), change.data(), 1);
      for (size_t i = 0; i < parts_.size() && is_good; ++i) {
        is_good = is_small_step(change.data() + i * kPoseUnknowns);
        poses[i] = moved(parts_[i].pose, change.data() + i * kPoseUnknowns);
      }
      for (size_t k = 0; k < codes_; ++k) z[k] += change[size_ - codes_ + k];
      const double next = is_good ? cost_of(poses, z) : INFINITY;
      if (!(next < cost)) {
        damping *= 10;
        continue;
      }
      const bool is_end = cost - next < 1e-4 * (1 + next);
      for (size_t i = 0; i < parts_.size(); ++i) parts_[i].pose = poses[i];
      z_ = std::move(z);
      cost = next;
      damping = std::max(damping * 0.1, 1e-9);
      is_current = false;
      if (is_end) break;
    }
  }

  std::vector<Participant>& parts_;
  size_t codes_, size_;
  std::vector<double> z_;
  int steps_ = 0;
  std::vector<double> a_, b_, part_a_, part_b_;
};

// A camera within the head is none. One that sees more of the far side of the head than of the near one, which without
// perspective looks the same, is that of a mirrored image.
PoseStatus checked(const CameraPose& pose, const std::vector<Correspondence>& points) {
  if (!(pose.camera.head_to_camera.translation.z > 0)) return PoseStatus::kNoConsensus;
  const Vec3 eye = inverse(pose.camera.head_to_camera) * Vec3{};
  std::ptrdiff_t near = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (pose.is_inlier[i]) near += dot(points[i].point_dm, eye - points[i].point_dm) > 0 ? 1 : -1;
  }
  return near > 0 ? pose.status : PoseStatus::kMirrored;
}

void check(const std::vector<HeadPhoto>& photos) {
  if (photos.empty() || photos.size() > kMaxFitPhotos) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A head is to be fitted to ", photos.size(), " photos. Give 1 to ",
                kMaxFitPhotos, ".");
  }
}

// Empty: the prior's covariance, the identity.
void set_covariance(AnchorFit& fit, std::vector<float> covariance) {
  const size_t codes = fit.shape_codes.size();
  if (covariance.empty()) {
    covariance.assign(codes * codes, 0.0f);
    for (size_t k = 0; k < codes; ++k) covariance[k * codes + k] = 1;
  }
  fit.code_sigmas.resize(codes);
  for (size_t k = 0; k < codes; ++k) fit.code_sigmas[k] = std::sqrt(std::max(0.0f, covariance[k * codes + k]));
  fit.code_covariance = std::move(covariance);
}

}  // namespace

size_t AnchorFit::used() const {
  return size_t(std::count_if(photos.begin(), photos.end(), [](const PhotoFit& photo) { return photo.is_used(); }));
}

AnchorFit fit_anchors(const HeadPrior& prior, const std::vector<HeadPhoto>& photos, const AnchorFitOptions& options) {
  check(photos);
  const AnchorPoints points(prior);
  AnchorFit result;
  result.shape_codes.assign(points.codes(), 0.0f);
  set_covariance(result, {});
  std::vector<Participant> parts;
  for (size_t i = 0; i < photos.size(); ++i) {
    const HeadPhoto& photo = photos[i];
    AnchorTerms terms(photo, points, options.terms);
    const CameraPose pose = find_camera_pose(
        terms.correspondences(),
        {photo.focal_px, photo.log_focal_sigma, photo.cx_px, photo.cy_px, options.min_inlier_fraction});
    PhotoFit fit;
    fit.status = pose.status;
    fit.cells = terms.cells();
    if (fit.is_used()) fit.status = checked(pose, terms.correspondences());
    result.photos.push_back(fit);
    if (!fit.is_used()) continue;
    parts.push_back(
        {i, std::move(terms), scaled_pose_of(pose.camera, {}), std::log(photo.focal_px), photo.log_focal_sigma});
  }
  while (!parts.empty()) {
    JointFit joint(parts, points.codes());
    joint.run(options.max_steps);
    // The photo that agrees least, if it agrees too little, shows another head: without it the others say more.
    size_t worst = 0;
    double least = 2;
    for (size_t i = 0; i < parts.size(); ++i) {
      const Participant& part = parts[i];
      const AnchorTerms::Agreement agreement = part.terms.agreement(part.pose, joint.codes().data());
      PhotoFit& fit = result.photos[part.photo];
      const HeadPhoto& photo = photos[part.photo];
      fit.camera = camera_of(part.pose, {}, photo.cx_px, photo.cy_px);
      fit.camera.width_px = photo.width_px, fit.camera.height_px = photo.height_px;
      fit.inliers = agreement.inliers;
      fit.rms_px = agreement.rms_px, fit.rms_sigma = agreement.rms_sigma;
      const double fraction = double(fit.inliers) / double(fit.cells);
      if (fraction < least) least = fraction, worst = i;
    }
    if (least >= options.min_inlier_fraction) {
      std::copy(joint.codes().begin(), joint.codes().end(), result.shape_codes.begin());
      set_covariance(result, joint.code_covariance());
      result.steps = joint.steps();
      result.cost = joint.cost();
      break;
    }
    PhotoFit& fit = result.photos[parts[worst].photo];
    fit = {PoseStatus::kNoConsensus, fit.cells, {}, 0, 0, 0};
    parts.erase(parts.begin() + std::ptrdiff_t(worst));
  }
  return result;
}

}  // namespace maq::head
