// Builds a scene from posed photos and a point cloud: loading, fitting, packing, and their times.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/assembly/descriptor_fitter.h"
#include "scene/capture/capture.h"
#include "scene/capture/posed_view.h"
#include "scene/format/scene_packing.h"

namespace maq {

enum class PointSource { kDefault, kCloud, kDepth };

struct SceneBuildOptions {
  FittingOptions fitting;
  ScenePacking packing;
  uint64_t max_points = 0;  // of larger clouds points are taken evenly; 0: all
  // Larger photos are shrunk. 0: no photo is shrunk, and photos over the networks' limit (SceneNetworks::kMaxPixels)
  // are left out.
  int long_side_px = 640;
  // For captures:
  size_t max_views = 0;                        // evenly from all that may be used; 0: all
  bool uses_held_out = false;                  // photos that the capture keeps for comparisons
  PointSource points = PointSource::kDefault;  // kDepth for sparse clouds, kCloud for others
};

struct SceneBuildStats {
  size_t views = 0, unused_views = 0;  // photos that saw points; that saw none or could not be used
  uint64_t cloud_points = 0;           // after max_points
  uint64_t seen_points = 0;
  double depth_ms = 0;  // of the depth of photos and its fusion; 0 where the cloud was used
  double load_ms = 0, pack_ms = 0;
  FittingTimes fitting;
};

// Photo by photo.
class SceneBuilder {
 public:
  // Throws as DescriptorFitter does, and MAQ_ERROR_INVALID_ARGUMENT for a negative long_side_px.
  SceneBuilder(PointCloud cloud, const std::array<double, 3>& up, std::shared_ptr<SceneNetworks> networks,
               const SceneBuildOptions& options);

  // Both return the number of points that the photo sees, or nothing if they were cancelled. They throw the errors of
  // PosedView::load() and DescriptorFitter::add_view(), and then change nothing.
  std::optional<size_t> add_view(const CaptureView& view, const BuildProgress& progress = {});
  std::optional<size_t> add_view(const ImageView& image, const Lens& lens, const PinholeCamera& pose,
                                 const BuildProgress& progress = {});

  // Like DescriptorFitter's: more photos can be added after finish(). After finish_and_forget(), which takes less
  // memory, the builder has no photos.
  Scene finish() { return packed(fitter_.finish()); }
  Scene finish_and_forget();
  void cancel() { fitter_.cancel(); }

  SceneBuildStats stats() const;

 private:
  std::optional<size_t> add_loaded(const BuildProgress& progress);
  Scene packed(const FittedPoints& points);

  std::shared_ptr<SceneNetworks> networks_;
  SceneBuildOptions options_;
  SceneBuildStats stats_;  // without the fitter's counts
  DescriptorFitter fitter_;
  PosedView photo_;
};

struct BuiltScene {
  Scene scene;
  SceneBuildStats stats;
  std::vector<Dropped> dropped;  // photos that could not be used, or see nothing
};

// Builds a scene from all photos of a capture, one after the other. With PointSource::kDepth the scene's points come
// from the depth of the photos, which is computed; of the cloud where that gives fewer. Returns nothing if `progress`
// cancelled. Throws
// MAQ_ERROR_INVALID_ARGUMENT also if all photos are held out, MAQ_ERROR_UNREADABLE if none can be used or sees a point,
// and the errors of SceneBuilder.
std::optional<BuiltScene> build_scene(const Capture& capture, const std::shared_ptr<SceneNetworks>& networks,
                                      const SceneBuildOptions& options, const BuildProgress& progress = {});

}  // namespace maq
