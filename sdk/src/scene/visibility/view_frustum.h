// What part of space a camera's picture shows, to leave out blocks of points that cannot be in it.
#pragma once

#include <array>

#include "scene/pinhole_camera.h"
#include "scene/format/scene.h"

namespace maq {

class ViewFrustum {
 public:
  ViewFrustum(const PinholeCamera& camera, double near);

  // False only where no point of the block can win a pixel, with all rounding of PointProjection; true for bounds that are
  // not finite.
  bool may_show(const Scene& scene, const SceneBlock& block) const;

 private:
  // Points d from the camera's centre are in front of a plane where along . d >= least.
  struct Plane {
    double along[3];
    double rounding[3];  // what a coordinate of 1 may add by rounding
    double least;
  };
  std::array<double, 3> centre_;
  Plane planes_[5];
};

}  // namespace maq
