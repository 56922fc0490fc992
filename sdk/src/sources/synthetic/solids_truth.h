// Ground truth of stub:solids: the sharp edges of its solids, and their parts that a camera sees.
#pragma once

#include <vector>

#include "sources/synthetic/solids_scene.h"

namespace maq {

// A straight edge between two flat sides, in the world. The rim of a cylinder is a circle of 256 edges.
struct SolidsEdge {
  Vector3 from{}, to{};
  Vector3 normals[2]{};     // normals of the two sides, outwards
  bool is_concave = false;  // as between an object and its support
};
std::vector<SolidsEdge> solids_edges(const SolidsScene& scene);

// A part of an edge that nothing hides and that the image has, in the directions of the camera from its place. Its
// ends are exact to 1e-9 of its length, unless another solid hides less than a quarter of a pixel of it.
struct VisibleSolidsEdge {
  Vector3 from{}, to{};
  bool is_concave = false;
  bool is_boundary = false;  // one of the two sides alone is seen; false: a crease
};
std::vector<VisibleSolidsEdge> visible_solids_edges(const SolidsScene& scene, const SolidsView& view,
                                                    const SolidsPicture& picture);

}  // namespace maq
