// A triangle mesh in the head frame: decimetres, x to the person's left, y to the back, z up.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace maq::head {

// How vertices move at the weight 1; all others stay.
struct MorphTarget {
  std::string name;                // letters, digits and _
  std::vector<uint32_t> vertices;  // that move, increasing
  std::vector<float> deltas;       // [vertices][3], decimetres
};

// A part that turns with its children: neck, head, jaw, eyes.
struct MeshJoint {
  std::string name;               // letters, digits and _
  int parent = -1;                // an earlier joint; -1: none
  std::array<float, 3> position;  // decimetres
};

// The joints that move a vertex, and by which shares; the sum is 1. Unused ones are joint 0 with the weight 0.
struct VertexJoints {
  std::array<uint8_t, 4> joints;
  std::array<float, 4> weights;
};

// An empty array is unknown. Arrays of floats and bytes are by vertex.
struct HeadMesh {
  std::vector<float> positions;            // x, y, z, decimetres
  std::vector<float> normals;              // x, y, z, of length 1, outwards
  std::vector<uint8_t> colours;            // R, G, B (sRGB)
  std::vector<float> template_points;      // x, y, z on the template head, decimetres
  std::vector<float> texture_coordinates;  // u to the right, v down, 0 to 1
  std::vector<uint32_t> triangles;         // three vertices each, counter-clockwise seen from outside
  std::vector<MorphTarget> morph_targets;  // of the template head alone, like what follows
  std::vector<MeshJoint> joints;           // the first has no parent
  std::vector<VertexJoints> vertex_joints;

  size_t vertex_count() const { return positions.size() / 3; }
  size_t triangle_count() const { return triangles.size() / 3; }
};

}  // namespace maq::head
