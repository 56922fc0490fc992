// Which pixels of depth maps become points of one cloud.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/worker_threads.h"
#include "image/geometry/pinhole_camera.h"
#include "scene/point_cloud.h"

namespace maq {

struct DepthMap {
  PinholeCamera camera;
  std::vector<float> depth;          // along the optical axis, row by row; 0: unknown
  std::vector<uint32_t> neighbours;  // maps that see the same
};

// Chosen on captures for validation: docs/research/scenes.md, "Fusion".
struct FusionRule {
  float agreement = 0.01f;  // difference of depth within which maps agree, as a part of it
  float farther = 0.03f;    // difference from which a map sees through a point
  // A point is kept while (1 + maps that agree) >= factor x (maps that see through it).
  float factor = 2;
};

struct FusedPixel {
  uint32_t map = 0, pixel = 0;
};

// Gets the finished fraction, 0..1. False cancels.
using FusionProgress = std::function<bool(double done)>;

// The pixels whose points are kept, by map and pixel; at most `max_points` of them (0: all), at random. The same for
// any number of threads. Nothing is asked of points that no neighbour sees. Empty when cancelled, too.
std::vector<FusedPixel> fuse_depth_maps(const std::vector<DepthMap>& maps, const FusionRule& rule, uint64_t max_points,
                                        WorkerThreads& threads, const FusionProgress& progress = {});

// Their positions, relative to `origin`. Pixels whose position is too far for a float are taken out of `pixels`.
PointCloud points_of(const std::vector<DepthMap>& maps, const std::array<double, 3>& origin,
                     std::vector<FusedPixel>& pixels);

}  // namespace maq
