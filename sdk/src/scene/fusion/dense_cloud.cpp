#include "scene/fusion/dense_cloud.h"

#include <algorithm>

#include "image/convert.h"
#include "scene/stereo/semi_global.h"
#include "scene/stereo/view_selection.h"

namespace maq {
namespace {

constexpr double kShareOfDepth = 0.85;  // of the time
constexpr size_t kVoters = 8;           // neighbours whose depth is asked about a point

std::string text_of_step(size_t photo, size_t photos) {
  return "Depth of photo " + std::to_string(photo + 1) + " of " + std::to_string(photos);
}

// Photos that cannot be loaded have no pixels.
std::vector<StereoPhoto> load_grey(const DenseCloudInput& input) {
  std::vector<StereoPhoto> photos(input.photos);
  PosedView loaded;
  for (size_t i = 0; i < input.photos; ++i) {
    if (!input.load(i, loaded)) continue;
    StereoPhoto& photo = photos[i];
    photo.camera = loaded.camera();
    photo.grey.resize(photo.pixels());
    copy_pixels(loaded.image(), MAQ_PIXEL_GREY8, photo.grey.data(), 0, photo.grey.size());
    if (loaded.valid() != nullptr) photo.valid.assign(loaded.valid(), loaded.valid() + photo.pixels());
  }
  return photos;
}

std::vector<uint8_t> colours_of(const DenseCloudInput& input, const std::vector<FusedPixel>& pixels) {
  std::vector<uint8_t> rgb;
  rgb.reserve(3 * pixels.size());
  PosedView photo;
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (i == 0 || pixels[i].map != pixels[i - 1].map) input.load(pixels[i].map, photo);
    const size_t width = size_t(photo.camera().width_px), x = pixels[i].pixel % width, y = pixels[i].pixel / width;
    const PlaneView& plane = photo.image().planes[0];
    const uint8_t* const bgr = plane.data + y * plane.stride_bytes + 3 * x;
    rgb.insert(rgb.end(), {bgr[2], bgr[1], bgr[0]});
  }
  return rgb;
}

// False when cancelled.
bool find_depth(const std::vector<StereoPhoto>& photos, const PointPositions& points, WorkerThreads& threads,
                const DenseCloudProgress& progress, std::vector<DepthMap>& maps) {
  std::vector<PinholeCamera> cameras;
  for (const StereoPhoto& photo : photos) cameras.push_back(photo.camera);
  std::vector<ViewPlan> plans = plan_views(cameras, points, kVoters);
  MatchingCost costs;
  SemiGlobal smooth;
  maps.resize(photos.size());
  for (size_t i = 0; i < photos.size(); ++i) {
    const double fraction = kShareOfDepth * double(i) / double(photos.size());
    if (progress && !progress(fraction, text_of_step(i, photos.size()))) return false;
    DepthMap& map = maps[i];
    map.camera = cameras[i];
    map.neighbours = plans[i].neighbours;
    map.depth.assign(photos[i].grey.size(), 0);
    if (!plans[i].has_depth()) continue;
    std::vector<const StereoPhoto*> neighbours;
    for (const uint32_t k : plans[i].neighbours) neighbours.push_back(&photos[k]);
    if (neighbours.size() > MatchingCost::kMaxNeighbours) neighbours.resize(MatchingCost::kMaxNeighbours);
    const DepthPlanes planes{plans[i].near, plans[i].far};
    costs.compute(photos[i], neighbours, planes, threads);
    smooth.solve(costs, planes, threads, map.depth);
    for (size_t k = 0; k < photos[i].valid.size(); ++k) {
      if (photos[i].valid[k] == 0) map.depth[k] = 0;
    }
  }
  return true;
}

}  // namespace

std::optional<DenseCloud> make_dense_cloud(const DenseCloudInput& input, const DenseCloudOptions& options,
                                           const DenseCloudProgress& progress) {
  DenseCloud made;
  WorkerThreads threads(options.threads);
  if (!find_depth(load_grey(input), input.points, threads, progress, made.maps)) return {};
  bool is_cancelled = false;
  std::vector<FusedPixel> pixels = fuse_depth_maps(made.maps, {}, options.max_points, threads, [&](double done) {
    is_cancelled = progress && !progress(kShareOfDepth + (1 - kShareOfDepth) * done, "Fusing the depth of all photos");
    return !is_cancelled;
  });
  if (is_cancelled) return {};
  made.cloud = points_of(made.maps, input.points.origin, pixels);
  if (options.wants_colours) made.cloud.rgb = colours_of(input, pixels);
  return made;
}

}  // namespace maq
