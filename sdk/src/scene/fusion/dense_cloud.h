// A dense cloud from posed photos and some points of the scene: depth of each photo, and what the depth maps agree on.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "scene/fusion/depth_fusion.h"
#include "scene/stereo/stereo_photo.h"

namespace maq {

struct DenseCloudOptions {
  uint64_t max_points = 1'500'000;
  int threads = 2;
};

struct DenseCloud {
  std::vector<DepthMap> maps;      // one for each photo
  std::vector<FusedPixel> pixels;  // of which the points are
  PointCloud cloud;                // around the origin of the points given
};

// Photos over this long side are to be made smaller: 256 bytes a pixel are needed for one of them.
inline constexpr int kDepthLongSidePx = 960;

// A photo of any colour as stereo takes it: BGR, without distortion. `valid` may be null: all is.
StereoPhoto stereo_photo_of(const ImageView& bgr, const uint8_t* valid, const PinholeCamera& camera);

// Gets the finished fraction, 0..1, and a sentence about the current step. False cancels.
using DenseCloudProgress = std::function<bool(double done, const std::string& what)>;

// Photos without a neighbour, or with fewer than 12 of the points, have no depth; with no depth at all there is no
// point. Returns false when cancelled; `made` is then undefined. The same for any number of threads.
bool make_dense_cloud(const std::vector<StereoPhoto>& photos, const PointPositions& points,
                      const DenseCloudOptions& options, const DenseCloudProgress& progress, DenseCloud& made);

}  // namespace maq
