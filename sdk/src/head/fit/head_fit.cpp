#include "head/fit/head_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/clock.h"
#include "core/error.h"
#include "head/fit/adam.h"

namespace maq::head {
namespace {

constexpr int kGridSide = 32;
constexpr double kGridDrift = 0.2;  // how far codes move, all together, before the grid is made anew
constexpr int kGridSteps = 20;      // or how many steps they take
constexpr int kMaxRefusals = 10;
constexpr double kMinRate = 0.2;      // of the rates, at which a fit without a gain ends
constexpr int kWarmUp = 5;            // steps over which the rates rise
constexpr double kFarStep = 2;        // a loss this many times the usual one is refused
constexpr double kFarCheck = 1.3;     // the same for the loss of held-out pixels
constexpr size_t kPixelsForAll = 16;  // photos, beyond which each is looked at with fewer pixels

class Shuffle {  // SplitMix64, Fisher and Yates
 public:
  explicit Shuffle(uint64_t seed) : state_(seed) {}
  void run(std::vector<uint32_t>& values) {
    for (size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[size_t(next() % i)]);
  }

 private:
  uint64_t next() {
    uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  uint64_t state_;
};

// The unknowns: shape codes, colour codes, and the cameras of the photos that have part.
struct State {
  FieldCodes codes;
  std::vector<ScaledPose> poses;
};

struct Part {
  size_t photo;
  AnchorTerms terms;
  double log_focal_mean, log_focal_sigma;
};

class Fitter {
 public:
  Fitter(const HeadPrior& prior, const std::vector<HeadPhoto>& photos, const HeadFitOptions& options,
         WorkerThreads& threads, const Stopwatch& watch, HeadFit& result)
      : prior_(prior),
        photos_(photos),
        options_(options),
        threads_(threads),
        watch_(watch),
        result_(result),
        engine_(prior.bases.shape()),
        weights_(prior.bases.shape()),
        grid_(prior.bounds, prior.cut, kGridSide),
        terms_(prior.bases.shape(), prior.cut, double(prior.sharpness), options.rays),
        gradient_{FieldWeights(prior.bases.shape()), {}},
        shape_codes_(size_t(prior.shape_codes())),
        colour_codes_(size_t(prior.colour_codes())),
        shuffle_(options.seed) {
    const AnchorPoints points(prior);
    now_.codes = result.codes;
    const std::vector<double> z = as_doubles(now_.codes.shape);
    for (size_t i = 0; i < photos.size(); ++i) {
      if (!result.photos[i].is_used()) continue;
      now_.poses.push_back(scaled_pose_of(result.photos[i].camera, {}));
      parts_.push_back({i, AnchorTerms(photos[i], points, options.anchors.terms), std::log(photos[i].focal_px),
                        photos[i].log_focal_sigma});
      parts_.back().terms.set_noise(now_.poses.back(), z.data(), 0);
    }
    const size_t unknowns = shape_codes_ + colour_codes_ + kPoseUnknowns * parts_.size();
    full_gradient_.resize(unknowns);
    change_.resize(unknowns);
    adam_ = Adam(unknowns);
    best_ = now_;
  }

  void run(const HeadFitCallback& callback) {
    sample_rays(options_.last_side_px, last_level_);
    held_out_ = pointers(last_level_.held_out);
    if (held_out_.empty()) held_out_ = every(pointers(last_level_.fitted), 20);
    HeadFitStats& stats = result_.stats;
    stats.pixels = last_level_.fitted.size() + last_level_.held_out.size();
    stats.held_out = last_level_.held_out.size();
    check();
    stats.first = stats.last = best_losses_;
    usual_loss_ = best_losses_.total();
    stats.end = std::isfinite(usual_loss_) ? loop(callback) : HeadFitEnd::kRefused;
    if (stats.end != HeadFitEnd::kCancelled && is_unchecked_) check();
    stats.last = best_losses_;
    publish();
  }

 private:
  HeadFitEnd loop(const HeadFitCallback& callback) {
    HeadFitStats& stats = result_.stats;
    const int first_steps = int(options_.first_fraction * options_.max_steps);
    double step_seconds = 0;
    while (stats.steps < options_.max_steps) {
      const double seconds = seconds_now();
      if (callback &&
          !callback({stats.steps, seconds, best_losses_.total(), best_.codes, result_.start, result_.photos})) {
        return HeadFitEnd::kCancelled;
      }
      if (seconds + step_seconds > options_.seconds) return HeadFitEnd::kSeconds;
      if (stats.steps == 0 || stats.steps == first_steps) begin_level(stats.steps < first_steps);
      if (!step()) {
        if (++stats.refused >= kMaxRefusals) return HeadFitEnd::kRefused;
        go_back();
      }
      ++stats.steps;
      if (stats.steps % options_.check_steps == 0) {
        check();
        if (stats.refused >= kMaxRefusals) return HeadFitEnd::kRefused;
        if (checks_without_gain_ >= options_.patience) {
          if (rate_ <= kMinRate) return HeadFitEnd::kNoGain;
          go_back();
          checks_without_gain_ = 0;
        }
      }
      step_seconds = seconds_now() - seconds;
    }
    return HeadFitEnd::kSteps;
  }

  double seconds_now() const { return watch_.elapsed_ms() / 1000; }

  static std::vector<double> as_doubles(const std::vector<float>& values) { return {values.begin(), values.end()}; }

  static std::vector<const FitRay*> pointers(const std::vector<FitRay>& rays) {
    std::vector<const FitRay*> result;
    for (const FitRay& ray : rays) result.push_back(&ray);
    return result;
  }

  static std::vector<const FitRay*> every(const std::vector<const FitRay*>& rays, size_t step) {
    std::vector<const FitRay*> result;
    for (size_t i = 0; i < rays.size(); i += step) result.push_back(rays[i]);
    return result;
  }

  void sample_rays(int side_px, FitRays& rays) const {
    rays = {};
    FitRayOptions options;
    const double fewer = std::min(1.0, std::sqrt(double(kPixelsForAll) / double(parts_.size())));
    options.side_px = std::max(8, int(side_px * fewer));
    options.held_out_fraction = options_.held_out_fraction;
    options.seed = options_.seed;
    for (size_t i = 0; i < parts_.size(); ++i) add_fit_rays(photos_[parts_[i].photo], uint32_t(i), options, rays);
  }

  void begin_level(bool is_first) {
    if (is_first) sample_rays(options_.first_side_px, first_level_);
    level_ = is_first ? &first_level_ : &last_level_;
    order_.resize(level_->fitted.size());
    std::iota(order_.begin(), order_.end(), 0u);
    next_ = order_.size();
  }

  void choose_rays() {
    chosen_.clear();
    const size_t count = std::min(size_t(options_.rays_per_step), order_.size());
    while (chosen_.size() < count) {
      if (next_ >= order_.size()) {
        shuffle_.run(order_);
        next_ = 0;
      }
      chosen_.push_back(&level_->fitted[order_[next_++]]);
    }
  }

  // Weight of a ray's loss when `count` rays represent all pixels.
  double ray_weight(const FitRays& level, size_t count) const {
    const double cells = level.cells_per_ray * double(level.fitted.size() + level.held_out.size());
    return count > 0 ? options_.ray_weight * cells / double(count) : 0;
  }

  void set_field(const State& state, bool is_exact) {
    prior_.bases.combine(state.codes, weights_);
    engine_.set_weights(weights_);
    double drift = 0;
    for (size_t k = 0; k < grid_codes_.size(); ++k) drift += std::pow(double(state.codes.shape[k] - grid_codes_[k]), 2);
    ++grid_age_;
    const bool is_old = grid_age_ > kGridSteps || drift > kGridDrift * kGridDrift || grid_age_ == 1;
    if (!is_old && !(is_exact && drift > 0)) return;
    grid_.update(engine_, threads_);
    grid_codes_ = state.codes.shape;
    grid_age_ = 1;
  }

  // Stage 0's terms and priors; adds their gradient where it is asked for.
  void add_priors(const State& state, HeadLosses& losses, double* gradient) {
    const std::vector<double> z = as_doubles(state.codes.shape);
    for (size_t k = 0; k < shape_codes_; ++k) {
      losses.prior += 0.5 * z[k] * z[k];
      if (gradient != nullptr) gradient[k] += z[k];
    }
    for (size_t k = 0; k < colour_codes_; ++k) {
      const auto code = double(state.codes.colour[k]);
      losses.prior += 0.5 * code * code;
      if (gradient != nullptr) gradient[shape_codes_ + k] += code;
    }
    std::vector<double> by_codes(shape_codes_);
    for (size_t i = 0; i < parts_.size(); ++i) {
      const Part& part = parts_[i];
      double by_pose[kPoseUnknowns] = {};
      losses.anchors += options_.anchor_weight *
                        part.terms.gradient(state.poses[i], z.data(), options_.anchor_weight, by_pose, by_codes.data());
      if (part.log_focal_sigma > 0) {
        const double off = (state.poses[i].log_focal - part.log_focal_mean) / part.log_focal_sigma;
        losses.prior += 0.5 * off * off;
        by_pose[kPoseUnknowns - 1] += off / part.log_focal_sigma;
      }
      if (gradient == nullptr) continue;
      double* to = gradient + shape_codes_ + colour_codes_ + kPoseUnknowns * i;
      for (size_t k = 0; k < kPoseUnknowns; ++k) to[k] += by_pose[k];
    }
    for (size_t k = 0; gradient != nullptr && k < shape_codes_; ++k) gradient[k] += by_codes[k];
  }

  // The loss of the state by the pixels held out; it becomes the best where it is less than that.
  void check() {
    HeadFitStats& stats = result_.stats;
    ++stats.checks;
    is_unchecked_ = false;
    set_field(now_, true);
    const RaySums sums = terms_.run(engine_, grid_, now_.poses, held_out_.data(), held_out_.size(), threads_, nullptr);
    HeadLosses losses;
    const double weight = ray_weight(last_level_, held_out_.size());
    losses.colour = weight * sums.colour, losses.matte = weight * sums.matte;
    losses.point = weight * sums.point;
    add_priors(now_, losses, nullptr);
    const double best = best_losses_.total(), loss = losses.total();
    if (stats.checks == 1 || loss < best) {
      const bool is_gain = stats.checks == 1 || best - loss > options_.min_gain * std::abs(best);
      checks_without_gain_ = is_gain ? 0 : checks_without_gain_ + 1;
      best_losses_ = losses;
      best_ = now_;
      publish_cameras();
      return;
    }
    ++checks_without_gain_;
    if (!(loss < kFarCheck * best + 1)) {
      ++stats.refused;
      go_back();
    }
  }

  // False where the state, which the step before made, cannot stay.
  bool step() {
    choose_rays();
    set_field(now_, false);
    const RaySums sums = terms_.run(engine_, grid_, now_.poses, chosen_.data(), chosen_.size(), threads_, &gradient_);
    result_.stats.rays += sums.rays;
    result_.stats.left_out += sums.left_out;
    const double weight = ray_weight(*level_, chosen_.size());
    std::fill(full_gradient_.begin(), full_gradient_.end(), 0.0);
    HeadLosses losses;
    add_priors(now_, losses, full_gradient_.data());
    const double loss = losses.total() + weight * sums.total();
    if (!std::isfinite(loss) || loss > kFarStep * usual_loss_ + 1) return false;
    usual_loss_ += 0.1 * (loss - usual_loss_);

    prior_.bases.code_gradient(gradient_.by_weights, by_codes_);
    double* to = full_gradient_.data();
    for (const float by : by_codes_.shape) *to++ += weight * double(by);
    for (const float by : by_codes_.colour) *to++ += weight * double(by);
    for (size_t i = 0; i < parts_.size(); ++i) {
      for (size_t k = 0; k < kPoseUnknowns; ++k) *to++ += weight * gradient_.by_poses[i][k];
      if (!(parts_[i].log_focal_sigma > 0)) *(to - 1) = 0;
    }
    if (!std::all_of(full_gradient_.begin(), full_gradient_.end(), [](double g) { return std::isfinite(g); })) {
      return false;
    }
    adam_.step(full_gradient_, rates(), change_);
    return move();
  }

  std::vector<double> rates() const {
    const double done = double(result_.stats.steps) / options_.max_steps;
    const double schedule =
        std::min(1.0, (steps_since_refusal_ + 1.0) / kWarmUp) * (0.55 + 0.45 * std::cos(3.14159265358979 * done));
    const double factor = rate_ * schedule;
    std::vector<double> result(full_gradient_.size());
    std::fill_n(result.begin(), shape_codes_, factor * options_.shape_rate);
    std::fill_n(result.begin() + std::ptrdiff_t(shape_codes_), colour_codes_, factor * options_.colour_rate);
    double* to = result.data() + shape_codes_ + colour_codes_;
    for (const ScaledPose& pose : now_.poses) {
      const double camera = factor * options_.camera_rate, pixels = camera * std::exp(pose.log_scale);
      for (const double rate : {camera, camera, camera, pixels, pixels, camera, camera}) *to++ = rate;
    }
    return result;
  }

  bool move() {
    const double* change = change_.data();
    for (float& code : now_.codes.shape) code += float(*change++);
    for (float& code : now_.codes.colour) code += float(*change++);
    bool is_good = true;
    for (ScaledPose& pose : now_.poses) {
      is_good = is_good && is_small_step(change);
      pose = moved(pose, change);
      change += kPoseUnknowns;
    }
    ++steps_since_refusal_;
    is_unchecked_ = true;
    const auto is_number = [](float code) { return std::isfinite(code); };
    return is_good && std::all_of(now_.codes.shape.begin(), now_.codes.shape.end(), is_number) &&
           std::all_of(now_.codes.colour.begin(), now_.codes.colour.end(), is_number);
  }

  // Takes up the best state again, with half the rates.
  void go_back() {
    now_ = best_;
    rate_ /= 2;
    steps_since_refusal_ = 0;
    is_unchecked_ = false;
    usual_loss_ = std::max(usual_loss_, best_losses_.total());
    adam_.reset();
  }

  // Cameras of the best state, for the result and for the callback.
  void publish_cameras() {
    const std::vector<double> z = as_doubles(best_.codes.shape);
    for (size_t i = 0; i < parts_.size(); ++i) {
      PhotoFit& fit = result_.photos[parts_[i].photo];
      const int width = fit.camera.width_px, height = fit.camera.height_px;
      fit.camera = camera_of(best_.poses[i], {}, fit.camera.cx_px, fit.camera.cy_px);
      fit.camera.width_px = width, fit.camera.height_px = height;
      const AnchorTerms::Agreement agreement = parts_[i].terms.agreement(best_.poses[i], z.data());
      fit.inliers = agreement.inliers;
      fit.rms_px = agreement.rms_px, fit.rms_sigma = agreement.rms_sigma;
    }
  }

  void publish() {
    result_.codes = best_.codes;
    publish_cameras();
  }

  const HeadPrior& prior_;
  const std::vector<HeadPhoto>& photos_;
  const HeadFitOptions& options_;
  WorkerThreads& threads_;
  const Stopwatch& watch_;
  HeadFit& result_;
  FieldEngine engine_;
  FieldWeights weights_;
  DistanceGrid grid_;
  RayTerms terms_;
  RayGradient gradient_;
  size_t shape_codes_, colour_codes_;
  Shuffle shuffle_;
  std::vector<Part> parts_;
  State now_, best_;
  HeadLosses best_losses_;
  double usual_loss_ = 0, rate_ = 1;
  int steps_since_refusal_ = 0, checks_without_gain_ = 0;
  bool is_unchecked_ = false;
  FitRays first_level_, last_level_;
  const FitRays* level_ = nullptr;
  std::vector<uint32_t> order_;
  size_t next_ = 0;
  std::vector<const FitRay*> chosen_, held_out_;
  std::vector<float> grid_codes_;
  int grid_age_ = 0;
  Adam adam_{0};
  FieldCodes by_codes_;
  std::vector<double> full_gradient_, change_;
};

}  // namespace

HeadFit fit_head(const HeadPrior& prior, const std::vector<HeadPhoto>& photos, const HeadFitOptions& options,
                 WorkerThreads& threads, const HeadFitCallback& callback) {
  const Stopwatch watch;
  HeadFit result{fit_anchors(prior, photos, options.anchors), {}, {}, FieldWeights(prior.bases.shape()), {}};
  result.codes.shape = result.start.shape_codes;
  result.codes.colour.assign(size_t(prior.colour_codes()), 0.0f);
  result.photos = result.start.photos;
  result.stats.anchor_seconds = watch.elapsed_ms() / 1000;
  if (result.start.is_found()) {
    result.stats.end = HeadFitEnd::kNoTime;
    if (result.stats.anchor_seconds < options.seconds) {
      Fitter(prior, photos, options, threads, watch, result).run(callback);
    }
  }
  prior.bases.combine(result.codes, result.weights);
  result.stats.seconds = watch.elapsed_ms() / 1000;
  return result;
}

}  // namespace maq::head
