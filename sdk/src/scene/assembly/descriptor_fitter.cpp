#include "scene/assembly/descriptor_fitter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/clock.h"
#include "core/error.h"
#include "image/geometry/warp.h"
#include "scene/assembly/descriptor_sampling.h"
#include "scene/gravity_alignment.h"

namespace maq {
namespace {

// Memory of the regressions: for each point of the cloud, and for each that was seen.
constexpr uint64_t kBytesAPoint = sizeof(uint32_t), kBytesASeenPoint = sizeof(DescriptorRegression) + sizeof(uint32_t);
// Features are near 1; squares of these are still floats.
constexpr float kLargestFeature = 1e15f;
constexpr size_t kTaskSpans = 16;

template <class... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  throw Error(MAQ_ERROR_INVALID_ARGUMENT, parts...);
}

void check_cloud(const PointCloud& cloud) {
  const size_t count = cloud.count();
  if (count == 0) refuse("The cloud has no points; a scene needs one at least.");
  if (count > kMaxPoints) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "The cloud has ", count, " points, over the limit of ", kMaxPoints,
                "; make it thinner.");
  }
  if (cloud.y.size() != count || cloud.z.size() != count) {
    refuse("The cloud has ", count, " x, ", cloud.y.size(), " y and ", cloud.z.size(),
           " z coordinates, but must have as many of each.");
  }
  for (size_t i = 0; i < count; ++i) {
    if (!std::isfinite(cloud.x[i]) || !std::isfinite(cloud.y[i]) || !std::isfinite(cloud.z[i])) {
      refuse("Point ", i, " of the cloud is at (", cloud.x[i], ", ", cloud.y[i], ", ", cloud.z[i],
             "), which is not finite; leave such points out.");
    }
  }
  for (const double origin : cloud.origin) {
    if (!std::isfinite(origin)) refuse("The cloud's origin has a coordinate ", origin, "; it must be finite.");
  }
}

const FittingOptions& checked(const std::array<double, 3>& up, const FittingOptions& options) {
  const double length = std::hypot(up[0], up[1], up[2]);
  if (!(length > 0) || !std::isfinite(length)) {
    refuse("Up is (", up[0], ", ", up[1], ", ", up[2], "), which has no direction.");
  }
  if (!(options.visibility_scale >= 1.0 / 16 && options.visibility_scale <= 1)) {
    refuse("The visibility scale is ", options.visibility_scale, ", but must be 1/16 to 1.");
  }
  if (!(options.near >= 0) || !std::isfinite(options.near)) {
    refuse("The depth of the nearest point is ", options.near, ", but must be finite and not negative.");
  }
  return options;
}

int scaled(int side_px, double scale) { return std::max(1, int(std::nearbyint(side_px * scale))); }

// Weight of the ridge regression, as in NPBG++ (arXiv 2203.13318).
constexpr double kAlpha = 1;

struct Solved {
  float beta[kBasis][kFeatures];
  float view_dependence;
  bool is_singular;
};

// The view-dependence of a descriptor: the root of the mean square of |(h - mean h) beta| over the photos that saw the
// point. The triangle R has the scatter of h as R^T R, so the sum of squares equals the one of R beta.
float view_dependence_of(const DescriptorRegression& regression, const float beta[kBasis][kFeatures]) {
  double sum = 0;
  const float* row = regression.triangle;
  for (int i = 0; i < kBasis; row += kBasis - i, ++i) {
    double values[kFeatures] = {};
    for (int j = i; j < kBasis; ++j) {
      for (int c = 0; c < kFeatures; ++c) values[c] += double(row[j - i]) * double(beta[j][c]);
    }
    for (const double value : values) sum += value * value;
  }
  const double view_dependence = std::sqrt(sum / regression.views);
  return float(std::min(view_dependence, double(std::numeric_limits<float>::max())));
}

template <class Value>
void append(std::vector<Value>& to, const Value* from, size_t count) {
  to.insert(to.end(), from, from + count);
}

// Appends all points of `regressions` to the arrays of `made`, in their order, and counts singular ones. With
// `forgets`, the regressions are freed on the way.
void solve_descriptors(RegressionStore& regressions, const PointPositions& positions, WorkerThreads& threads,
                       bool forgets, FittedPoints& made) {
  const size_t count = regressions.count();
  // Reserved at once, or each array would be there twice while it grows; pages not yet written take no memory.
  for (std::vector<float>* array : {&made.x, &made.y, &made.z, &made.view_dependence}) array->reserve(count);
  made.views.reserve(count);
  made.constant_terms.reserve(count * kFeatures);
  made.linear_terms.reserve(count * kBasis * kFeatures);

  constexpr size_t kBatch = 10'000, kTask = 1'000;
  static_assert(RegressionStore::kChunk % kBatch == 0);
  std::vector<Solved> solved(std::min(count, kBatch));
  for (size_t first = 0; first < count; first += kBatch) {
    const size_t size = std::min(kBatch, count - first), end = first + size;
    threads.run((size + kTask - 1) / kTask, [&](size_t task, int) {
      for (size_t i = task * kTask; i < std::min(size, (task + 1) * kTask); ++i) {
        const DescriptorRegression& known = regressions.at(first + i);
        Solved& descriptor = solved[i];
        descriptor.is_singular = solve_descriptor(known, kAlpha, descriptor.beta) == DescriptorKind::kSingular;
        descriptor.view_dependence = view_dependence_of(known, descriptor.beta);
      }
    });
    for (size_t i = 0; i < size; ++i) {
      const uint32_t point = regressions.points()[first + i];
      const DescriptorRegression& known = regressions.at(first + i);
      made.x.push_back(positions.x[point]);
      made.y.push_back(positions.y[point]);
      made.z.push_back(positions.z[point]);
      append(made.constant_terms, known.mean_y, kFeatures);
      append(made.linear_terms, solved[i].beta[0], kBasis * kFeatures);
      made.view_dependence.push_back(solved[i].view_dependence);
      made.views.push_back(known.views);
      made.singular += solved[i].is_singular ? 1 : 0;
    }
    if (forgets && (end == count || end % RegressionStore::kChunk == 0))
      regressions.forget_chunk((end - 1) / RegressionStore::kChunk);
  }
}

}  // namespace

DescriptorFitter::DescriptorFitter(PointCloud cloud, const std::array<double, 3>& up, SceneNetworks& networks,
                                   const FittingOptions& options)
    : cloud_(std::move(cloud)),
      up_(up),
      networks_(networks),
      options_(checked(up, options)),
      threads_(options.threads) {
  check_cloud(cloud_);
  cloud_.rgb = {};
  check_memory(0);
  regressions_.begin(cloud_.count());
}

void DescriptorFitter::check_memory(size_t new_points) const {
  const uint64_t wanted = cloud_.count() * kBytesAPoint + (regressions_.count() + new_points) * kBytesASeenPoint;
  if (wanted <= options_.max_bytes) return;
  throw Error(MAQ_ERROR_OUT_OF_MEMORY, "Fitting ", regressions_.count() + new_points, " seen points of a cloud of ",
              cloud_.count(), " would take ", wanted >> 20, " MiB, over the limit of ", options_.max_bytes >> 20,
              "; make the cloud thinner, or raise the limit.");
}

size_t DescriptorFitter::find_seen_points(const uint8_t* valid, const PinholeCamera& camera) {
  const PinholeCamera scaled_camera = resized(camera, scaled(camera.width_px, options_.visibility_scale),
                                              scaled(camera.height_px, options_.visibility_scale));
  visible_.begin(scaled_camera, options_.near, threads_.count());
  PointSpan whole;
  for (size_t i = 0; i < 3; ++i) whole.base[i] = cloud_.origin[i] - camera.centre[i];
  constexpr size_t kTask = kTaskSpans * PointSpan::kMaxPoints;
  threads_.run((cloud_.count() + kTask - 1) / kTask, [&](size_t task, int worker) {
    const size_t end = std::min(cloud_.count(), (task + 1) * kTask);
    PointSpan span = whole;
    for (size_t begin = task * kTask; begin < end; begin += PointSpan::kMaxPoints) {
      span.x = cloud_.x.data() + begin;
      span.y = cloud_.y.data() + begin;
      span.z = cloud_.z.data() + begin;
      span.count = uint32_t(std::min<size_t>(PointSpan::kMaxPoints, end - begin));
      span.first = uint32_t(begin);
      visible_.draw(span, worker);
    }
  });
  visible_.finish(0, scaled_camera.height_px);
  visible_.remove_occluded(0, scaled_camera.height_px, kDepthTolerance);

  const size_t pixels = size_t(scaled_camera.width_px) * size_t(scaled_camera.height_px);
  seen_.clear();
  for (size_t pixel = 0; pixel < pixels; ++pixel) {
    if (visible_.keys()[pixel] != kNoPointKey) seen_.push_back(point_of(visible_.keys()[pixel]));
  }
  if (valid != nullptr) keep_valid(cloud_.positions(), camera, valid, seen_);
  return size_t(std::count_if(seen_.begin(), seen_.end(), [&](uint32_t point) { return !regressions_.has(point); }));
}

const float* DescriptorFitter::find_features(const ImageView& photo, const PinholeCamera& camera,
                                             const PinholeCamera& aligned) {
  {
    const ScopedTimer timer(times_.align_ms);
    warp_to_rgb(photo, pixel_map_between(aligned, camera), aligned.width_px, aligned.height_px, aligned_photo_);
  }
  const ScopedTimer timer(times_.extract_ms);
  const float* features = networks_.extract(aligned_photo_.data(), aligned.width_px, aligned.height_px);
  const size_t count = size_t(aligned.width_px) * size_t(aligned.height_px) * kFeatures;
  for (size_t i = 0; i < count; ++i) {
    if (!(std::abs(features[i]) <= kLargestFeature)) {
      throw Error(MAQ_ERROR_INFERENCE, "The extractor of bundle ", networks_.name(), " gives the feature ", features[i],
                  " for a photo; the network is broken. Fetch or export the bundle again.");
    }
  }
  return features;
}

std::optional<size_t> DescriptorFitter::add_view(const ImageView& photo, const uint8_t* valid,
                                                 const PinholeCamera& camera, const BuildProgress& progress) {
  check_camera(camera, "The photo's camera");
  if (photo.format != MAQ_PIXEL_BGR8) {
    refuse("The photo is in ", pixel_format_name(photo.format), ", but must be BGR.");
  }
  if (photo.width_px != camera.width_px || photo.height_px != camera.height_px) {
    refuse("The photo is ", photo.width_px, " x ", photo.height_px, " pixels, but its camera is for ", camera.width_px,
           " x ", camera.height_px, ".");
  }
  const PinholeCamera aligned = gravity_aligned_frame(camera, up_, SceneNetworks::kPhotoMultiple);
  SceneNetworks::check_photo_size(aligned.width_px, aligned.height_px);
  const auto goes_on = [&](double done, const char* what) {
    const bool wanted = !progress || progress(done, what);
    return wanted && !is_cancelled_;
  };
  // However this ends, a cancel of this photo does not cancel a later one.
  struct Reset {
    std::atomic<bool>& flag;
    ~Reset() { flag = false; }
  } const reset{is_cancelled_};

  if (!goes_on(0, "Finding visible points.")) return {};
  {
    const ScopedTimer timer(times_.visibility_ms);
    const size_t new_points = find_seen_points(valid, camera);
    check_memory(new_points);
    regressions_.reserve(new_points);
  }
  if (seen_.empty()) return 0;
  BackgroundColour background;
  background.add(photo, valid, visible_);
  if (!goes_on(0.1, "Extracting features.")) return {};
  const float* features = find_features(photo, camera, aligned);
  if (!goes_on(0.9, "Fitting descriptors.")) return {};

  // From here on nothing fails or is cancelled.
  background_.add(background);
  const ScopedTimer timer(times_.accumulate_ms);
  for (const uint32_t point : seen_) {
    if (!regressions_.has(point)) regressions_.add(point);
  }
  const DescriptorSampling sampling(cloud_.positions(), aligned, features, networks_.basis());
  constexpr size_t kTask = kTaskSpans * DescriptorSampling::kMaxPoints;
  threads_.run((seen_.size() + kTask - 1) / kTask, [&](size_t task, int) {
    const size_t end = std::min(seen_.size(), (task + 1) * kTask);
    for (size_t begin = task * kTask; begin < end; begin += DescriptorSampling::kMaxPoints) {
      sampling.add(seen_.data() + begin, std::min(DescriptorSampling::kMaxPoints, end - begin), regressions_);
    }
  });
  ++views_;
  return seen_.size();
}

FittedPoints DescriptorFitter::solve(bool forgets) {
  if (regressions_.count() == 0) {
    refuse("None of the photos sees a point of the cloud, which has ", cloud_.count(),
           ", so there is no scene; check that photos and cloud are of the same scene, in the same unit.");
  }
  const ScopedTimer timer(times_.solve_ms);
  FittedPoints made;
  made.origin = cloud_.origin;
  made.up = up_;
  made.background = background_.mean();
  made.never_seen = cloud_.count() - regressions_.count();
  solve_descriptors(regressions_, cloud_.positions(), threads_, forgets, made);
  return made;
}

FittedPoints DescriptorFitter::finish_and_forget() {
  FittedPoints made = solve(true);
  regressions_ = RegressionStore();
  regressions_.begin(cloud_.count());
  background_ = {};
  views_ = 0;
  return made;
}

}  // namespace maq
