// Samples one photo at the points that it sees: the feature of each, and the direction from which it is seen.
#pragma once

#include <cstdint>
#include <vector>

#include "image/geometry/pinhole_camera.h"
#include "scene/assembly/regression_store.h"
#include "scene/networks/view_basis.h"
#include "scene/point_cloud.h"

namespace maq {

// Keeps the points of `points` (indices) with a valid pixel of the photo: not 0 in `valid`, row by row.
void keep_valid(const PointPositions& positions, const PinholeCamera& camera, const uint8_t* valid,
                std::vector<uint32_t>& points);

class DescriptorSampling {
 public:
  // `features` [height][width][kFeatures] of the photo as `camera` shows it. All must outlive this.
  DescriptorSampling(const PointPositions& positions, const PinholeCamera& camera, const float* features,
                     const ViewBasis& basis);

  static constexpr size_t kMaxPoints = 256;

  // Adds the photo to the regressions of `count` points, at most kMaxPoints and each once. The feature is bilinear, the
  // border repeated outside. Several threads may do so for different points.
  void add(const uint32_t* points, size_t count, RegressionStore& regressions) const;

 private:
  PointPositions places_;
  const PinholeCamera& camera_;
  const float* features_;
  const ViewBasis& basis_;
  float rotation_[9];  // the first two rows times the focal lengths
};

}  // namespace maq
