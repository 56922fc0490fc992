#include "scene/fusion/dense_cloud.h"

#include <algorithm>

#include "image/convert.h"
#include "scene/stereo/semi_global.h"
#include "scene/stereo/view_selection.h"

namespace maq {
namespace {

constexpr double kDepthFraction = 0.85;  // of the time
constexpr size_t kVoters = 8;            // neighbours whose depth is asked about a point
constexpr size_t kPhotosPerTrust = 9;    // see FusionRule::min_trust
constexpr int kMaxTrust = 5;

}  // namespace

StereoPhoto stereo_photo_of(const ImageView& bgr, const uint8_t* valid, const PinholeCamera& camera) {
  StereoPhoto photo;
  photo.camera = camera;
  photo.grey.resize(photo.pixels());
  copy_pixels(bgr, MAQ_PIXEL_GREY8, photo.grey.data(), 0, photo.grey.size());
  if (valid != nullptr) photo.valid.assign(valid, valid + photo.pixels());
  return photo;
}

bool make_dense_cloud(const std::vector<StereoPhoto>& photos, const PointPositions& points,
                      const DenseCloudOptions& options, const DenseCloudProgress& progress, DenseCloud& made) {
  std::vector<PinholeCamera> cameras;
  for (const StereoPhoto& photo : photos) cameras.push_back(photo.camera);
  const std::vector<ViewPlan> plans = plan_views(cameras, points, kVoters);
  WorkerThreads threads(options.threads);
  made = {};
  made.maps.resize(photos.size());
  {
    MatchingCost costs;
    SemiGlobal smooth;
    for (size_t i = 0; i < photos.size(); ++i) {
      if (progress && !progress(kDepthFraction * double(i) / double(photos.size()),
                                "Depth of photo " + std::to_string(i + 1) + " of " + std::to_string(photos.size()))) {
        return false;
      }
      DepthMap& map = made.maps[i];
      map.camera = cameras[i];
      map.neighbours = plans[i].neighbours;
      map.depth.assign(photos[i].pixels(), 0);
      if (!plans[i].has_depth()) continue;
      std::vector<const StereoPhoto*> neighbours;
      for (const uint32_t k : plans[i].neighbours) neighbours.push_back(&photos[k]);
      neighbours.resize(std::min(neighbours.size(), size_t(MatchingCost::kMaxNeighbours)));
      const DepthPlanes planes{plans[i].near, plans[i].far};
      costs.compute(photos[i], neighbours, planes, threads);
      smooth.solve(costs, planes, threads, map.depth);
      for (size_t k = 0; k < photos[i].valid.size(); ++k) {
        if (photos[i].valid[k] == 0) map.depth[k] = 0;
      }
    }
  }
  FusionRule rule;
  rule.min_trust = std::min(std::max(1, int(photos.size() / kPhotosPerTrust)), kMaxTrust);
  bool is_cancelled = false;
  made.pixels = fuse_depth_maps(made.maps, rule, options.max_points, threads, [&](double done) {
    is_cancelled = progress && !progress(kDepthFraction + (1 - kDepthFraction) * done, "Joining the depth of all photos");
    return !is_cancelled;
  });
  if (is_cancelled) return false;
  made.cloud = points_of(made.maps, made.pixels, points.origin);
  return true;
}

}  // namespace maq
