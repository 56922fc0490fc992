// What one photo says of the points that it sees: a feature of each, and from which side.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/build/regression_store.h"
#include "scene/networks/view_basis.h"
#include "scene/pinhole_camera.h"
#include "scene/point_cloud.h"

namespace maq {

// Leaves those of `points` (indices) whose pixel of the photo is valid: not 0 in `valid`, row by row.
void keep_valid(const PointPlaces& places, const PinholeCamera& camera, const uint8_t* valid,
                std::vector<uint32_t>& points);

class LookSampling {
 public:
  // `features` [height][width][kFeatures] of the photo as `camera` shows it. All must outlive this.
  LookSampling(const PointPlaces& places, const PinholeCamera& camera, const float* features, const ViewBasis& basis);

  static constexpr size_t kMostPoints = 256;

  // Adds the photo to what is known of `count` points, at most kMostPoints, of which none is there twice. The feature is
  // bilinear, the border repeated outside. Several threads may do so for different points.
  void add(const uint32_t* points, size_t count, MomentStore& moments) const;

 private:
  PointPlaces places_;
  const PinholeCamera& camera_;
  const float* features_;
  const ViewBasis& basis_;
  float rotation_[9];  // the first two rows times the focal lengths
};

}  // namespace maq
