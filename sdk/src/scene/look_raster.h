// What the refiner sees of a view: for each pixel how the point there looks from this side, at five scales
// (NPBG++, arXiv 2203.13318, section 3.4).
//
// Coarser scales are reduced from the finest, which is exact: half a camera's size moves a point from pixel floor(x) to
// pixel floor(x / 2), so whoever is nearest of the points of a coarse pixel is nearest in one of its four fine ones.
// Sides must be multiples of 16 for that. Who wins no pixel is not shaded.
#pragma once

#include <vector>

#include "scene/view_basis.h"
#include "scene/visible_points.h"

namespace maq {

// How points look: beta0 [kFeatures] and beta [kBasis][kFeatures] of each, one after the other.
struct LookTable {
  const float* means = nullptr;
  const float* slopes = nullptr;  // null: no point's look depends on the side
};

class LookRaster {
 public:
  static constexpr int kLevels = 5;
  static constexpr int kMultiple = 1 << (kLevels - 1);
  static constexpr int kChannels = kFeatures + 1;  // the last is 1 where there is a point

  // Throws MAQ_ERROR_INVALID_ARGUMENT where the picture's sides are no multiples of 16.
  void shade(const VisiblePoints& visible, const PointPlaces& points, const LookTable& looks, const ViewBasis& basis,
             const PinholeCamera& camera);

  // [kChannels][height >> level][width >> level]; 0 where there is no point.
  const std::vector<float>& level(int level) const { return levels_[level]; }
  // Points that were shaded: those that win a pixel.
  size_t shaded() const { return pixels_.size(); }

 private:
  std::vector<float> levels_[kLevels];
  std::vector<uint32_t> pixels_;  // of the finest level, where there is a point
  std::vector<float> directions_, basis_values_;
};

}  // namespace maq
