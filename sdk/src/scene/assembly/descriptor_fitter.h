// Fits the descriptors of a cloud's points to posed photos: NPBG++ (arXiv 2203.13318), sections 3.1 to 3.3, one photo
// at a time.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "image/geometry/pinhole_camera.h"
#include "scene/assembly/background_colour.h"
#include "scene/assembly/regression_store.h"
#include "scene/format/fitted_points.h"
#include "scene/networks/scene_networks.h"
#include "scene/point_cloud.h"
#include "scene/visibility/z_buffer.h"

namespace maq {

struct FittingOptions {
  // Fraction of a photo's sides at which visible points are found, 1/16 to 1. Below 1, a point occludes more of the
  // points behind it.
  double visibility_scale = 1;
  double near = 0;  // depth of the nearest point that is seen, in units of the scene
  int threads = 2;  // for work on single points; the networks have their own
  // For all regressions: 340 bytes for each point that was seen, and 4 for each of the cloud.
  uint64_t max_bytes = uint64_t(2) << 30;
};

// Gets the finished fraction, 0..1, and a sentence about the current step. False cancels.
using BuildProgress = std::function<bool(double done, const std::string& what)>;

struct FittingTimes {
  double visibility_ms = 0, align_ms = 0, extract_ms = 0, accumulate_ms = 0, solve_ms = 0;
};

class DescriptorFitter {
 public:
  // `networks` must outlive this, and not be used elsewhere meanwhile. Throws MAQ_ERROR_INVALID_ARGUMENT for a cloud
  // without points or with one that is not finite, an up without a direction, options out of range;
  // MAQ_ERROR_UNSUPPORTED for more than kMaxPoints; MAQ_ERROR_OUT_OF_MEMORY where max_bytes is too little for the
  // cloud.
  DescriptorFitter(PointCloud cloud, const std::array<double, 3>& up, SceneNetworks& networks,
                   const FittingOptions& options);

  // A photo, BGR, and its camera. `valid`: the validity mask, 0 for pixels that are not of the photo, row by row; null
  // when all are. Returns how many points it saw, 0 included; nothing where it was cancelled. If it throws, the fitter
  // stays as it was: MAQ_ERROR_INVALID_ARGUMENT for an invalid camera or one of another size, MAQ_ERROR_IMAGE_SIZE for
  // a photo over the limit of the networks, MAQ_ERROR_OUT_OF_MEMORY if max_bytes is too little, and the errors of
  // SceneNetworks::extract().
  std::optional<size_t> add_view(const ImageView& photo, const uint8_t* valid, const PinholeCamera& camera,
                                 const BuildProgress& progress = {});

  // From any thread: the running add_view(), or else the next, changes nothing and returns nothing.
  void cancel() { is_cancelled_ = true; }

  // The fit to the photos so far; more can be added afterwards. Points come in the order in which they were seen first.
  // Throws MAQ_ERROR_INVALID_ARGUMENT where no photo saw a point.
  FittedPoints finish() { return solve(false); }
  // The same in less memory: regressions are freed on the way. Afterwards the fitter is empty, as at first.
  FittedPoints finish_and_forget();

  // Regressions of the points that some photo saw, in the order of finish().
  const RegressionStore& regressions() const { return regressions_; }

  size_t views() const { return views_; }
  size_t cloud_points() const { return cloud_.count(); }
  size_t seen_points() const { return regressions_.count(); }
  const FittingTimes& times() const { return times_; }

 private:
  // Fills seen_ and returns how many of them are new.
  size_t find_seen_points(const uint8_t* valid, const PinholeCamera& camera);
  const float* find_features(const ImageView& photo, const PinholeCamera& camera, const PinholeCamera& aligned);
  void check_memory(size_t new_points) const;
  FittedPoints solve(bool forgets);

  PointCloud cloud_;
  std::array<double, 3> up_;
  SceneNetworks& networks_;
  FittingOptions options_;
  WorkerThreads threads_;
  RegressionStore regressions_;
  BackgroundColour background_;
  size_t views_ = 0;
  std::atomic<bool> is_cancelled_{false};
  FittingTimes times_;
  // Memory for one photo, kept for the next.
  ZBuffer visible_;
  std::vector<uint32_t> seen_;
  std::vector<float> aligned_photo_;
};

}  // namespace maq
