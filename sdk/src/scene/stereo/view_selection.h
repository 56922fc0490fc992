// Which photos a photo is compared with, and how near and far what it shows is.
#pragma once

#include <cstdint>
#include <vector>

#include "image/geometry/pinhole_camera.h"
#include "scene/point_cloud.h"

namespace maq {

struct ViewPlan {
  std::vector<uint32_t> neighbours;  // indices, the best first
  double near = 0, far = 0;          // depths between which most of the points are

  // Depths are floats.
  bool has_depth() const { return !neighbours.empty() && near > 1e-30 && far < 1e30; }
};

// Neighbours see the points that a photo sees from some 6 degrees aside, each point two of them if possible: near
// points other ones than far points. At most `max_neighbours` each. A
// photo that sees fewer than 12 points has none, and neither has one whose neighbours all stand where it stands.
std::vector<ViewPlan> plan_views(const std::vector<PinholeCamera>& cameras, const PointPositions& points,
                                 size_t max_neighbours);

}  // namespace maq
