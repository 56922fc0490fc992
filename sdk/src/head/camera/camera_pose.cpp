#include "head/camera/camera_pose.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "core/error.h"
#include "core/math/small_solve.h"
#include "head/camera/pose_refinement.h"

namespace maq::head {

namespace {

constexpr double kMaxValue = 1e6;
constexpr double kInlierLimit = 13.8;  // squared sigmas of two coordinates: 99.9 %
constexpr double kRobustLimit = 9;
constexpr size_t kScored = 128, kRefined = 256;  // points that hypotheses, and the best of them, are measured by
constexpr int kMinTrials = 40, kMaxTrials = 400;
constexpr int kMirroredTrials = 120;  // that a mirrored head is not missed which explains far more than another's pose
constexpr size_t kCandidates = 6;
constexpr double kAmbiguousCost = 9;  // a pose worse by 3 sigmas is not in doubt
constexpr double kMaxRotationSigma_rad = 0.5;

class Dice {  // SplitMix64
 public:
  size_t below(size_t count) {
    uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return size_t((z ^ (z >> 31)) % count);
  }

 private:
  uint64_t state_ = 25;
};

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <class Value>
double median_of(const std::vector<PosePoint>& points, Value value) {
  std::vector<double> values;
  values.reserve(points.size());
  for (const PosePoint& point : points) values.push_back(value(point));
  return median_of(std::move(values));
}

// The two orientations of three points seen without perspective (Huttenlocher and Ullman 1990): they differ by which
// end is the near one.
int three_point_poses(const PosePoint& p0, const PosePoint& p1, const PosePoint& p2, double log_focal,
                      ScaledPose poses[2]) {
  const Vec3 a = p1.p - p0.p, b = p2.p - p0.p, normal = cross(a, b);
  const double aa = dot(a, a), bb = dot(b, b), ab = dot(a, b);
  if (!(dot(normal, normal) > 1e-4 * aa * bb) || !(aa > 0 && bb > 0)) return 0;
  const double ax = p1.x - p0.x, ay = p1.y - p0.y, bx = p2.x - p0.x, by = p2.y - p0.y;
  const double mm = ax * ax + ay * ay, nn = bx * bx + by * by, mn = ax * bx + ay * by;
  // The depths h of both ends, in pixels: h1^2 = S aa - mm, h2^2 = S bb - nn, h1 h2 = S ab - mn; S = s^2.
  const double quadratic = aa * bb - ab * ab, linear = aa * nn + bb * mm - 2 * ab * mn, constant = mm * nn - mn * mn;
  const double root = std::sqrt(std::max(0.0, linear * linear - 4 * quadratic * constant));
  const double square = (linear + root) / (2 * quadratic);
  if (!(square > 0)) return 0;
  const double s = std::sqrt(square);
  const double h1 = std::sqrt(std::max(0.0, square * aa - mm));
  const double h2 = std::copysign(std::sqrt(std::max(0.0, square * bb - nn)), square * ab - mn);
  for (int i = 0; i < 2; ++i) {
    const double sign = i == 0 ? 1 : -1;
    const Vec3 qa = normalized({ax, ay, sign * h1}), qn = normalized(cross(qa, {bx, by, sign * h2}));
    const Vec3 pa = normalized(a), pn = normalized(normal), qb = cross(qn, qa), pb = cross(pn, pa);
    const Mat3 to = {qa.x, qb.x, qn.x, qa.y, qb.y, qn.y, qa.z, qb.z, qn.z};
    const Mat3 from = {pa.x, pa.y, pa.z, pb.x, pb.y, pb.z, pn.x, pn.y, pn.z};
    ScaledPose& pose = poses[i];
    pose.rotation = to * from;
    const Vec3 q0 = pose.rotation * p0.p;
    pose.u_px = p0.x - s * q0.x;
    pose.v_px = p0.y - s * q0.y;
    pose.log_scale = std::log(s);
    pose.log_focal = log_focal;
  }
  return 2;
}

struct Hypothesis {
  ScaledPose pose;
  double cost = INFINITY;
};

double angle_between(const ScaledPose& a, const ScaledPose& b) {
  return length(log_rotation(a.rotation * transposed(b.rotation)));
}

// Keeps the best that differ by more than `apart_rad`.
void keep(std::vector<Hypothesis>& best, const Hypothesis& found, double apart_rad) {
  for (Hypothesis& known : best) {
    if (angle_between(known.pose, found.pose) > apart_rad ||
        std::abs(known.pose.log_focal - found.pose.log_focal) > 0.2) {
      continue;
    }
    if (found.cost < known.cost) known = found;
    return;
  }
  if (best.size() < kCandidates) {
    best.push_back(found);
    return;
  }
  Hypothesis& worst = *std::max_element(best.begin(), best.end(), [](auto& a, auto& b) { return a.cost < b.cost; });
  if (found.cost < worst.cost) worst = found;
}

class PoseSearch {
 public:
  PoseSearch(std::vector<PosePoint> points, const FocalPrior& prior, size_t min_inliers, int max_trials)
      : points_(std::move(points)),
        prior_(prior),
        min_inliers_(min_inliers),
        max_trials_(max_trials),
        all_(points_.size()) {
    std::iota(all_.begin(), all_.end(), size_t(0));
    centre_x_ = median_of(points_, [](const PosePoint& p) { return p.x; });
    centre_y_ = median_of(points_, [](const PosePoint& p) { return p.y; });
    radius_px_ = median_of(points_, [&](const PosePoint& p) { return std::hypot(p.x - centre_x_, p.y - centre_y_); });
    sigma_px_ = median_of(points_, [](const PosePoint& p) { return p.sigma_px; });
    // The possible error, at other points, of a pose from three noisy points.
    coarse_limit_ = std::pow(std::max(6.0, 0.05 * radius_px_ / sigma_px_), 2);
    Dice dice;
    sample_ = all_;
    for (size_t i = 0; i < std::min(kRefined, sample_.size()); ++i) {
      std::swap(sample_[i], sample_[i + dice.below(sample_.size() - i)]);
    }
    sample_.resize(std::min(kRefined, sample_.size()));
  }

  // Poses with enough inliers, the best first.
  std::vector<Hypothesis> run() {
    std::vector<Hypothesis> best = propose(), found;
    std::sort(best.begin(), best.end(), [](auto& a, auto& b) { return a.cost < b.cost; });
    std::vector<Hypothesis> refined;
    for (Hypothesis& start : best) {
      double limit = coarse_limit_;
      while (limit > kRobustLimit) {
        refine_pose(start.pose, points_, sample_.data(), sample_.size(), prior_, limit, 6);
        limit /= 9;
      }
      start.cost = refine_pose(start.pose, points_, sample_.data(), sample_.size(), prior_, kRobustLimit, 10);
      keep(refined, start, 0.05);
    }
    std::sort(refined.begin(), refined.end(), [](auto& a, auto& b) { return a.cost < b.cost; });
    // Another as good as the best shows in a sample.
    while (refined.size() > 2 || (refined.size() == 2 && refined[1].cost > refined[0].cost + 3 * kAmbiguousCost)) {
      refined.pop_back();
    }
    for (Hypothesis& pose : refined) {
      pose.cost = refine_pose(pose.pose, points_, all_.data(), all_.size(), prior_, kRobustLimit, 20);
      if (is_consensus(inliers_of(pose.pose).size())) found.push_back(pose);
    }
    std::sort(found.begin(), found.end(), [](auto& a, auto& b) { return a.cost < b.cost; });
    return found;
  }

  std::vector<size_t> inliers_of(const ScaledPose& pose) const {
    std::vector<size_t> inliers;
    for (size_t i = 0; i < points_.size(); ++i) {
      if (squared_error(pose, points_[i]) <= kInlierLimit) inliers.push_back(i);
    }
    return inliers;
  }

  const std::vector<PosePoint>& points() const { return points_; }
  const FocalPrior& prior() const { return prior_; }

 private:
  // Least-squares poses of triples, scored by a sample.
  std::vector<Hypothesis> propose() {
    std::vector<Hypothesis> best;
    Dice dice;
    const size_t count = points_.size(), scored = std::min(kScored, sample_.size());
    const int focals = prior_.sigma > 0 ? 2 * int(std::ceil(2 * prior_.sigma / 0.35)) + 1 : 1;
    double needed = kMinTrials;
    for (int trial = 0; trial < max_trials_ && trial < needed; ++trial) {
      size_t chosen[3];
      for (size_t i = 0; i < 3; ++i) {
        do chosen[i] = dice.below(count);
        while (std::find(chosen, chosen + i, chosen[i]) != chosen + i);
      }
      // From the prior's median outwards: 0, 1, -1, 2, -2, ...
      const int k = trial % focals, side = (k + 1) / 2 * (k % 2 == 1 ? 1 : -1);
      const int sides = focals / 2;
      const double log_focal = prior_.log_mean + (sides > 0 ? 2 * prior_.sigma * side / sides : 0);
      ScaledPose poses[2];
      const int made = three_point_poses(points_[chosen[0]], points_[chosen[1]], points_[chosen[2]], log_focal, poses);
      for (int i = 0; i < made; ++i) {
        refine_pose(poses[i], points_, chosen, 3, {log_focal, 0}, INFINITY, 8);
        Hypothesis found{poses[i], 0};
        size_t near = 0;
        for (size_t j = 0; j < scored; ++j) {
          const PosePoint& point = points_[sample_[j]];
          const double error = squared_error(found.pose, point);
          near += error < coarse_limit_;
          found.cost += point.weight * (error < INFINITY ? error / (1 + error / coarse_limit_) : coarse_limit_);
        }
        keep(best, found, 0.15);
        best_fraction_ = std::max(best_fraction_, double(near) / double(scored));
      }
      // Some of the right triples are too small, or have another focal length.
      const double good = 0.8 * best_fraction_ * best_fraction_ * best_fraction_;
      needed = std::max(double(kMinTrials), good > 1e-3 ? std::log(1e-5) / std::log(1 - good) : double(max_trials_));
    }
    return best;
  }

  // Enough, and more than chance would put near the best of all triples' poses (a contrario; Moisan and Stival 2004).
  bool is_consensus(size_t inliers) const {
    const size_t count = points_.size();
    if (inliers < min_inliers_) return false;
    if (inliers == count) return true;
    const double area = std::pow(1.5 * radius_px_ / sigma_px_, 2);
    const double log_chance = std::log(std::min(1.0, kInlierLimit / std::max(area, 1e-9)));
    const auto log_choose = [](double n, double k) {
      return std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1);
    };
    const double n = double(count), k = double(inliers);
    return std::log(2) + log_choose(n, 3) + log_choose(n, k) + (k - 3) * log_chance < std::log(0.1);
  }

  std::vector<PosePoint> points_;
  FocalPrior prior_;
  size_t min_inliers_;
  int max_trials_;
  std::vector<size_t> all_, sample_;
  double centre_x_ = 0, centre_y_ = 0, radius_px_ = 0, sigma_px_ = 1, coarse_limit_ = 0, best_fraction_ = 0;
};

// True if all points but up to three of many are on one line or at one position: so few points may be outliers, and
// cannot decide the rotation about the line. Lines through random pairs, since an outlier far off would tilt the one of
// least squares.
bool are_collinear(const std::vector<PosePoint>& points, const std::vector<size_t>& chosen) {
  const size_t count = chosen.size(), spare = std::min(size_t(3), (count - 4) / 4);
  Dice dice;
  for (int trial = 0; trial < 12; ++trial) {
    const Vec3 from = points[chosen[dice.below(count)]].p;
    const Vec3 along = points[chosen[dice.below(count)]].p - from, axis = normalized(along);
    const double tolerance = std::max(1e-3 * length(along), 1e-9);
    size_t off = 0;
    for (size_t i = 0; i < count && off <= spare; ++i) {
      const Vec3 d = points[chosen[i]].p - from;
      off += length(length(along) > 0 ? cross(d, axis) : d) > tolerance;
    }
    if (off <= spare) return true;
  }
  return false;
}

// Computes the covariance of rotation, translation of the head's frame and log focal length, from the information of
// the scaled pose. Returns false if the photo does not determine the rotation.
bool find_covariance(const ScaledPose& pose, Vec3 origin, PoseInformation& information, int unknowns,
                     std::array<double, 49>& covariance) {
  double inverse[49] = {};
  for (int i = 0; i < unknowns; ++i) inverse[i * unknowns + i] = 1;
  if (!solve_positive(&information[0][0], unknowns, 7, inverse, unknowns)) return false;
  double worst = 0;
  for (int i = 0; i < 3; ++i) worst = std::max(worst, inverse[i * unknowns + i]);
  if (!(worst < kMaxRotationSigma_rad * kMaxRotationSigma_rad)) return false;
  // t = (u / s, v / s, f / s) - R origin.
  const double s = std::exp(pose.log_scale), z = std::exp(pose.log_focal - pose.log_scale);
  const Vec3 q = pose.rotation * origin;
  const double jacobian[7][7] = {{1},
                                 {0, 1},
                                 {0, 0, 1},
                                 {0, -q.z, q.y, 1 / s, 0, -pose.u_px / s, 0},
                                 {q.z, 0, -q.x, 0, 1 / s, -pose.v_px / s, 0},
                                 {-q.y, q.x, 0, 0, 0, -z, z},
                                 {0, 0, 0, 0, 0, 0, 1}};
  covariance.fill(0);
  for (int i = 0; i < unknowns; ++i) {
    for (int j = 0; j < unknowns; ++j) {
      double& sum = covariance[size_t(i) * 7 + size_t(j)];
      for (int k = 0; k < unknowns; ++k) {
        for (int l = 0; l < unknowns; ++l) sum += jacobian[i][k] * inverse[k * unknowns + l] * jacobian[j][l];
      }
    }
  }
  return true;
}

void check_options(const CameraPoseOptions& options) {
  if (!(options.focal_px > 0) || !std::isfinite(options.focal_px)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The focal length is ", options.focal_px,
                " pixels. Give a positive one: it is the prior's median where it is not known.");
  }
  if (!(options.log_focal_sigma >= 0 && options.log_focal_sigma <= 3)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The standard deviation of the focal length's logarithm is ",
                options.log_focal_sigma, ". Give 0 to 3; 0 means that the focal length is known.");
  }
  if (!std::isfinite(options.cx_px) || !std::isfinite(options.cy_px)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The principal point (", options.cx_px, ", ", options.cy_px,
                ") is not finite. Give the middle of the picture if it is not known.");
  }
  if (!(options.min_inlier_fraction >= 0 && options.min_inlier_fraction <= 1)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The smallest fraction of inliers is ", options.min_inlier_fraction,
                ". Give 0 to 1.");
  }
}

bool is_usable(const Correspondence& point) {
  for (const double value : {point.point_dm.x, point.point_dm.y, point.point_dm.z, point.x_px, point.y_px}) {
    if (!(std::abs(value) <= kMaxValue)) return false;
  }
  return point.weight > 0 && point.weight <= kMaxValue && point.sigma_px > 1e-6 && point.sigma_px <= kMaxValue;
}

}  // namespace

const char* pose_status_text(PoseStatus status) {
  switch (status) {
    case PoseStatus::kFound: return "It is seen from a known side.";
    case PoseStatus::kAmbiguous: return "It may be turned in two ways, which look almost alike.";
    case PoseStatus::kTooFewPoints: return "Too little of it is seen.";
    case PoseStatus::kCollinear: return "What is seen of it does not tell how it is turned.";
    case PoseStatus::kNoConsensus: return "What is seen does not fit a head from any side.";
    case PoseStatus::kMirrored: return "What is seen fits a head only in a mirrored photo.";
  }
  return "";
}

CameraPose find_camera_pose(const std::vector<Correspondence>& given, const CameraPoseOptions& options) {
  check_options(options);
  CameraPose result;
  std::vector<PosePoint> points;
  std::vector<size_t> index;
  for (size_t i = 0; i < given.size(); ++i) {
    const Correspondence& from = given[i];
    if (!is_usable(from)) continue;
    points.push_back({from.point_dm, from.x_px - options.cx_px, from.y_px - options.cy_px, from.sigma_px, from.weight});
    index.push_back(i);
  }
  result.unusable = given.size() - points.size();
  if (points.size() < 4) return result;
  const Vec3 origin = {median_of(points, [](const PosePoint& p) { return p.p.x; }),
                       median_of(points, [](const PosePoint& p) { return p.p.y; }),
                       median_of(points, [](const PosePoint& p) { return p.p.z; })};
  for (PosePoint& point : points) point.p = point.p - origin;
  std::vector<size_t> all(points.size());
  std::iota(all.begin(), all.end(), size_t(0));
  if (are_collinear(points, all)) {
    result.status = PoseStatus::kCollinear;
    return result;
  }

  const FocalPrior prior = {std::log(options.focal_px), options.log_focal_sigma};
  const size_t min_inliers =
      std::max(size_t(4), size_t(std::ceil(options.min_inlier_fraction * double(points.size()))));
  PoseSearch search(points, prior, min_inliers, kMaxTrials);
  std::vector<Hypothesis> found = search.run();
  const size_t agreeing = found.empty() ? 0 : search.inliers_of(found[0].pose).size();
  if (2 * agreeing < points.size()) {
    // A mirrored image of the head is the image of the mirrored head. Part of it may fit in front, too.
    std::vector<PosePoint> mirrored = points;
    for (PosePoint& point : mirrored) point.p.x = -point.p.x;
    PoseSearch other(std::move(mirrored), prior, min_inliers, found.empty() ? kMaxTrials : kMirroredTrials);
    const std::vector<Hypothesis> behind = other.run();
    const size_t mirrored_inliers = behind.empty() ? 0 : other.inliers_of(behind[0].pose).size();
    if (4 * mirrored_inliers > 5 * agreeing || found.empty()) {
      result.status = behind.empty() ? PoseStatus::kNoConsensus : PoseStatus::kMirrored;
      return result;
    }
  }

  ScaledPose pose = found[0].pose;
  std::vector<size_t> inliers = search.inliers_of(pose);
  PoseInformation information;
  for (int round = 0; round < 5; ++round) {
    refine_pose(pose, points, inliers.data(), inliers.size(), prior, INFINITY, 20, &information);
    std::vector<size_t> next = search.inliers_of(pose);
    if (next == inliers || next.size() < min_inliers) break;
    inliers = std::move(next);
  }
  if (are_collinear(points, inliers) ||
      !find_covariance(pose, origin, information, prior.sigma > 0 ? 7 : 6, result.covariance)) {
    result.status = PoseStatus::kCollinear;
    result.covariance.fill(0);
    return result;
  }
  const bool is_ambiguous = found.size() > 1 && found[1].cost - found[0].cost < kAmbiguousCost &&
                            angle_between(found[0].pose, found[1].pose) > 0.1;
  result.status = is_ambiguous ? PoseStatus::kAmbiguous : PoseStatus::kFound;
  result.camera = camera_of(pose, origin, options.cx_px, options.cy_px);
  result.is_inlier.assign(given.size(), 0);
  result.inliers = inliers.size();
  double squares_px = 0, squares_sigma = 0;
  for (const size_t i : inliers) {
    const double error = squared_error(pose, points[i]);
    result.is_inlier[index[i]] = 1;
    squares_sigma += error;
    squares_px += error * points[i].sigma_px * points[i].sigma_px;
  }
  result.rms_px = std::sqrt(squares_px / (2 * double(inliers.size())));
  result.rms_sigma = std::sqrt(squares_sigma / (2 * double(inliers.size())));
  return result;
}

}  // namespace maq::head
