#include "scene/assembly/build_scene.h"

#include <algorithm>

#include "core/clock.h"
#include "core/error.h"
#include "scene/capture/posed_photo.h"
#include "scene/fusion/dense_cloud.h"

namespace maq {
namespace {

// The fraction of the work that is left when all photos are added.
constexpr double kSolvingFraction = 0.05;
// The fraction of the work before, where depth is computed.
constexpr double kDepthFraction = 0.7;

PointCloud thinned(PointCloud cloud, uint64_t max_points) {
  thin_out(cloud, max_points);
  return cloud;
}

std::vector<const CaptureView*> chosen_views(const Capture& capture, const SceneBuildOptions& options) {
  std::vector<const CaptureView*> views;
  for (const CaptureView& view : capture.views) {
    if (!view.is_held_out || options.uses_held_out) views.push_back(&view);
  }
  if (views.empty()) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "All of the capture's ", capture.views.size(),
                " photos are held out; a scene needs one.");
  }
  const size_t count = options.max_views == 0 ? views.size() : std::min(views.size(), options.max_views);
  std::vector<const CaptureView*> even;
  for (size_t i = 0; i < count; ++i) even.push_back(views[i * views.size() / count]);
  return even;
}

// Why a photo cannot be used; null for errors that are not the photo's.
const char* fault_of_photo(maq_status status) {
  switch (status) {
    case MAQ_ERROR_NOT_FOUND: return kPhotosMissing;
    case MAQ_ERROR_UNREADABLE: return kPhotosUnreadable;
    case MAQ_ERROR_IMAGE_SIZE: return "photos that are too large for the networks";
    default: return nullptr;
  }
}

// The part of a progress from `begin` to `end`.
BuildProgress part_of(const BuildProgress& progress, double begin, double end) {
  if (!progress) return {};
  return [=](double done, const std::string& what) { return progress(begin + done * (end - begin), what); };
}

std::optional<PointCloud> cloud_from_depth(const Capture& capture, const std::vector<const CaptureView*>& views,
                                           const SceneBuildOptions& options, const BuildProgress& progress) {
  DenseCloudInput input;
  input.photos = views.size();
  input.points = capture.cloud.positions();
  input.load = [&](size_t index, PosedView& photo) {
    try {
      photo.load(*views[index], kDepthLongSidePx);
    } catch (const Error& error) {
      if (fault_of_photo(error.status()) == nullptr) throw;
      return false;  // it is reported when it is added
    }
    return true;
  };
  DenseCloudOptions wanted;
  if (options.max_points != 0) wanted.max_points = options.max_points;
  wanted.threads = options.fitting.threads;
  std::optional<DenseCloud> made = make_dense_cloud(input, wanted, progress);
  if (!made) return {};
  if (made->cloud.count() < capture.cloud.count()) return capture.cloud;
  return std::move(made->cloud);
}

}  // namespace

SceneBuilder::SceneBuilder(PointCloud cloud, const std::array<double, 3>& up, std::shared_ptr<SceneNetworks> networks,
                           const SceneBuildOptions& options)
    : networks_(std::move(networks)),
      options_(options),
      fitter_(thinned(std::move(cloud), options.max_points), up, *networks_, options.fitting) {
  if (options.long_side_px < 0) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The photos' long side is to be ", options.long_side_px,
                " pixels; it must be positive, or 0 for photos as they are.");
  }
  stats_.cloud_points = fitter_.cloud_points();
}

std::optional<size_t> SceneBuilder::add_view(const CaptureView& view, const BuildProgress& progress) {
  {
    const ScopedTimer timer(stats_.load_ms);
    photo_.load(view, options_.long_side_px);
  }
  return add_loaded(progress);
}

std::optional<size_t> SceneBuilder::add_view(const ImageView& image, const Lens& lens, const PinholeCamera& pose,
                                             const BuildProgress& progress) {
  {
    const ScopedTimer timer(stats_.load_ms);
    photo_.load(image, lens, pose, options_.long_side_px);
  }
  return add_loaded(progress);
}

std::optional<size_t> SceneBuilder::add_loaded(const BuildProgress& progress) {
  const std::optional<size_t> seen = fitter_.add_view(photo_.image(), photo_.valid(), photo_.camera(), progress);
  if (seen && *seen == 0) ++stats_.unused_views;
  return seen;
}

Scene SceneBuilder::packed(const FittedPoints& points) {
  const ScopedTimer timer(stats_.pack_ms);
  Scene scene = make_scene(points, options_.packing);
  scene.networks_sha256 = networks_->sha256();
  return scene;
}

Scene SceneBuilder::finish_and_forget() {
  networks_->forget_extractor();
  return packed(fitter_.finish_and_forget());
}

SceneBuildStats SceneBuilder::stats() const {
  SceneBuildStats stats = stats_;
  stats.views = fitter_.views();
  stats.seen_points = fitter_.seen_points();
  stats.fitting = fitter_.times();
  return stats;
}

std::optional<BuiltScene> build_scene(const Capture& capture, const std::shared_ptr<SceneNetworks>& networks,
                                      const SceneBuildOptions& options, const BuildProgress& whole) {
  const std::vector<const CaptureView*> views = chosen_views(capture, options);
  if (capture.cloud.count() == 0) {
    throw Error(MAQ_ERROR_NOT_FOUND,
                "The capture has depth images but no point cloud, from which scenes are built; name a "
                "PLY file in its transforms.json as \"ply_file_path\".");
  }
  const bool computes_depth =
      options.points == PointSource::kDefault ? capture.is_sparse : options.points == PointSource::kDepth;
  double depth_ms = 0;
  std::optional<PointCloud> cloud;
  if (computes_depth) {
    const ScopedTimer timer(depth_ms);
    cloud = cloud_from_depth(capture, views, options, part_of(whole, 0, kDepthFraction));
    if (!cloud) return {};
  }
  const BuildProgress progress = part_of(whole, computes_depth ? kDepthFraction : 0, 1);
  SceneBuilder builder(cloud ? *cloud : capture.cloud, capture.up, networks, options);
  ImportReport report;
  size_t unusable = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    const CaptureView& view = *views[i];
    const auto of_all = [&](double done, const std::string& what) {
      const double fraction = (1 - kSolvingFraction) * (double(i) + done) / double(views.size());
      return !progress ||
             progress(fraction, "Photo " + std::to_string(i + 1) + " of " + std::to_string(views.size()) + ": " + what);
    };
    try {
      const std::optional<size_t> seen = builder.add_view(view, of_all);
      if (!seen) return {};
      if (*seen == 0) report.add("photos that see no point of the cloud", view.name);
    } catch (const Error& error) {
      const char* reason = fault_of_photo(error.status());
      if (reason == nullptr) throw;
      report.add(reason, view.name);
      ++unusable;
    }
  }
  BuiltScene built;
  built.dropped = report.list();
  built.stats = builder.stats();
  built.stats.unused_views += unusable;
  built.stats.depth_ms = depth_ms;
  if (built.stats.views == 0) {
    throw Error(MAQ_ERROR_UNREADABLE, "None of the photos can be used: ", describe(built.dropped), ".");
  }
  if (progress && !progress(1 - kSolvingFraction, "Solving for the descriptors.")) return {};
  built.scene = builder.finish_and_forget();
  // Views and points were counted before they were forgotten.
  const SceneBuildStats after = builder.stats();
  built.stats.fitting = after.fitting;
  built.stats.pack_ms = after.pack_ms;
  if (progress) progress(1, "The scene is built.");
  return built;
}

}  // namespace maq
