// From posed photos and a cloud to points that know how they look: NPBG++ (arXiv 2203.13318), sections 3.1 to 3.3, one photo
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
#include "scene/build/background_colour.h"
#include "scene/build/regression_store.h"
#include "scene/format/fitted_points.h"
#include "scene/networks/scene_networks.h"
#include "scene/pinhole_camera.h"
#include "scene/point_cloud.h"
#include "scene/visibility/z_buffer.h"

namespace maq {

struct BuildOptions {
  // Of a photo's sides, for finding which points it sees: below 1 a point hides more of what is behind it. 1/16 to 1.
  double visibility_scale = 1;
  double near = 0;  // depth of the nearest point that is seen, in units of the scene
  int threads = 2;  // for what is done point by point; the networks have theirs
  // What the builder may take in all for what it knows of points: 336 bytes each that was seen, 4 for others.
  uint64_t most_bytes = uint64_t(2) << 30;
};

// Gets how much is done, 0..1, and what is being done, as a sentence. False cancels.
using BuildProgress = std::function<bool(double done, const std::string& what)>;

struct BuildTimes {
  double visibility_ms = 0, turning_ms = 0, extractor_ms = 0, moments_ms = 0, solving_ms = 0;
};

class SceneBuilder {
 public:
  // `networks` must outlive this, and run for nobody else meanwhile. Throws MAQ_ERROR_INVALID_ARGUMENT for a cloud without
  // points or with one that is not finite, an up that is no direction, options out of range; MAQ_ERROR_UNSUPPORTED for more
  // than kMostPoints; MAQ_ERROR_OUT_OF_MEMORY where most_bytes do not do for the cloud.
  SceneBuilder(PointCloud cloud, const std::array<double, 3>& up, SceneNetworks& networks, const BuildOptions& options);

  // A photo, BGR, and its camera. `valid`: 0 for pixels that say nothing, row by row; null when all do. Returns how many points
  // it saw, which may be none; nothing where it was cancelled. Whatever it throws, the builder stays as it was before:
  // MAQ_ERROR_INVALID_ARGUMENT for a camera that is none or is for another size, MAQ_ERROR_IMAGE_SIZE for a photo over the
  // limit of the networks, MAQ_ERROR_OUT_OF_MEMORY where most_bytes do not do, and what SceneNetworks::extract() throws.
  std::optional<size_t> add_view(const ImageView& photo, const uint8_t* valid, const PinholeCamera& camera,
                                 const BuildProgress& progress = {});

  // From any thread: the add_view() that runs, or else the next, changes nothing and returns nothing.
  void cancel() { is_cancelled_ = true; }

  // What is known by now; photos can be added afterwards. Points come in the order in which they were seen first. Throws
  // MAQ_ERROR_INVALID_ARGUMENT where no photo saw a point.
  ModelledPoints finish() { return solve(false); }
  // The same in less memory: what is known is given back on the way, and so is the extractor's memory. Afterwards the
  // builder knows nothing, as at first.
  ModelledPoints finish_and_forget();

  // What is known of the points that some photo saw, in the order of finish().
  const MomentStore& moments() const { return moments_; }

  size_t views() const { return views_; }
  size_t seen_points() const { return moments_.count(); }
  const BuildTimes& times() const { return times_; }

 private:
  // Fills seen_ and returns how many of them are new.
  size_t find_seen_points(const uint8_t* valid, const PinholeCamera& camera);
  const float* find_features(const ImageView& photo, const PinholeCamera& camera, const PinholeCamera& upright);
  void check_memory(size_t new_points) const;
  ModelledPoints solve(bool forgets);

  PointCloud cloud_;
  std::array<double, 3> up_;
  SceneNetworks& networks_;
  BuildOptions options_;
  WorkerThreads threads_;
  MomentStore moments_;
  BackgroundColour background_;
  size_t views_ = 0;
  std::atomic<bool> is_cancelled_{false};
  BuildTimes times_;
  // Of one photo, kept for the next.
  ZBuffer visible_;
  std::vector<uint32_t> seen_;
  std::vector<float> turned_;
};

}  // namespace maq
