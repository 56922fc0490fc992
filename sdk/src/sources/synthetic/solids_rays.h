// Rays of a camera against the solids of a scene, in float64: the nearest hit.
#pragma once

#include <vector>

#include "sources/synthetic/solids_scene.h"

namespace maq {

class SolidsRays {
 public:
  SolidsRays() = default;  // of an empty scene
  SolidsRays(const SolidsScene& scene, const SolidsView& view) { look(scene, view); }

  // From another place; memory is kept.
  void look(const SolidsScene& scene, const SolidsView& view);

  // Depth along the optical axis of the first hit of the ray in direction (x, y, 1) of the camera; infinite without a
  // hit.
  double depth(double x, double y) const;

  // Writes the depth of each pixel in metres, 0 where there is nothing.
  void draw(const SolidsPicture& picture, float* metres) const;

 private:
  // A solid as the camera sees it: the camera's place and its axes in the directions of the solid.
  struct SeenSolid {
    Vector3 half{}, origin{};
    std::array<Vector3, 3> axes{};
    double radius = 0;
  };
  struct Window {
    int left, top, right, bottom;
  };

  static double enter(const SeenSolid& solid, double x, double y);
  // The pixels that it may cover.
  static Window window_of(const SeenSolid& solid, const SolidsPicture& picture);

  std::vector<SeenSolid> solids_;
};

}  // namespace maq
