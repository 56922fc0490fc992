// What is true of the solids of stub:solids: their sharp edges, and which parts of these a camera sees.
#pragma once

#include <vector>

#include "sources/synthetic/solids_scene.h"

namespace maq {

// A straight edge between two flat sides, in the world. Of the rims of a cylinder, one of 256 pieces of the circle.
struct SolidsEdge {
  Vector3 from{}, to{};
  Vector3 normals[2]{};     // of the two sides, outwards
  bool is_concave = false;  // as between a thing and what it stands on
};
std::vector<SolidsEdge> solids_edges(const SolidsScene& scene);

// A part of an edge that nothing hides and that the picture has, in the directions of the camera from its place. Its
// ends are exact to 1e-9 of its length, unless another solid hides less than a quarter of a pixel of it.
struct VisibleSolidsEdge {
  Vector3 from{}, to{};
  bool is_concave = false;
  bool is_boundary = false;  // one of the two sides alone is seen; false: a crease
};
std::vector<VisibleSolidsEdge> visible_solids_edges(const SolidsScene& scene, const SolidsView& view,
                                                    const SolidsPicture& picture);

}  // namespace maq
