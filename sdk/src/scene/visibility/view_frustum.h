// The view frustum of a camera, to cull blocks of points that cannot be in its image.
#pragma once

#include <array>

#include "image/geometry/pinhole_camera.h"
#include "scene/format/scene.h"

namespace maq {

class ViewFrustum {
 public:
  ViewFrustum(const PinholeCamera& camera, double near);

  // False only where no point of the block can be visible, with all rounding of PointProjection; true for bounds that
  // are not finite.
  bool may_show(const Scene& scene, const SceneBlock& block) const;

 private:
  // Points d from the camera's centre are in front of a plane where along . d >= min_distance.
  struct Plane {
    double along[3];
    double rounding[3];  // rounding error of a coordinate of 1
    double min_distance;
  };
  std::array<double, 3> centre_;
  Plane planes_[5];
};

}  // namespace maq
