// A dense cloud from posed photos and some points of the scene: depth of each photo, and what the depth maps agree on.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "scene/capture/posed_view.h"
#include "scene/fusion/depth_fusion.h"

namespace maq {

struct DenseCloudOptions {
  uint64_t max_points = 1'500'000;
  int threads = 2;
  bool wants_colours = false;
};

struct DenseCloud {
  std::vector<DepthMap> maps;  // one for each photo; without pixels for photos that were not loaded
  PointCloud cloud;            // around the origin of the points given
};

// Larger photos are made smaller: 256 bytes a pixel are needed for one of them.
inline constexpr int kDepthLongSidePx = 960;

struct DenseCloudInput {
  size_t photos = 0;
  // Loads a photo, of any size; false if it cannot be used. Called twice for each photo where colours are wanted.
  std::function<bool(size_t index, PosedView& photo)> load;
  PointPositions points;
};

// Gets the finished fraction, 0..1, and a sentence about the current step. False cancels.
using DenseCloudProgress = std::function<bool(double done, const std::string& what)>;

// Photos without a neighbour, or with fewer than 12 of the points in their image, have no depth; with no depth at all
// there is no point. Nothing when cancelled. The same for any number of threads. Throws the errors of `load`.
std::optional<DenseCloud> make_dense_cloud(const DenseCloudInput& input, const DenseCloudOptions& options,
                                           const DenseCloudProgress& progress = {});

}  // namespace maq
