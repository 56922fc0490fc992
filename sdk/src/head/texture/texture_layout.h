// Where points of the template head lie in a texture: a disc, its middle the crown, its border the cut, the face
// upright in its lower half, symmetric. It has no seam but the rim of the cap, whose own disc is in the lower right
// corner.
//
// A direction from a point in the neck's axis, at the angle a from the upward one, lies sin(a / 2) from the middle of
// the disc: equal solid angles have equal areas there (Lambert's azimuthal projection). Folds of the surface, such as
// behind the ears and below hanging hair, share their texels with the surface outside of them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/math/vec3.h"
#include "head/mesh/head_mesh.h"

namespace maq::head {

// The point of the template head (dm) from which directions are mapped: it sees most of the surface.
inline constexpr Vec3 kLayoutCentre{0, 0, -0.6};

// (u, v) of a point of the template head in decimetres: u to the right, v down, within 0 to 1.
std::array<float, 2> texture_place(Vec3 template_point);

// The angle between the upward direction and the directions that lie so far from the middle of the disc, in radians.
double texture_angle(double radius);

// Whether the position is in the cap.
bool is_in_cap_disc(float u, float v);

// Sets the texture coordinates of a mesh with template points. `is_cap`: of each vertex (find_cap); triangles of three
// such vertices go to the cap's disc, and where they meet others, a vertex is added at the end for each that both have.
void set_texture_coordinates(HeadMesh& mesh, const std::vector<uint8_t>& is_cap);

}  // namespace maq::head
