// Meshes of heads as glTF 2.0 in one file.
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/files/glb_writer.h"
#include "head/mesh/file_axes.h"
#include "head/mesh/mesh_files.h"

namespace maq::head {
namespace {

// sRGB to linear light (IEC 61966-2-1), both 0 to 255.
std::array<uint8_t, 256> linear_bytes() {
  std::array<uint8_t, 256> made{};
  for (size_t i = 0; i < made.size(); ++i) {
    const double value = double(i) / 255;
    const double linear = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
    made[i] = uint8_t(std::lround(255 * linear));
  }
  return made;
}

// Four bytes a vertex: vertices must begin at multiples of four.
std::vector<uint8_t> linear_colours(const std::vector<uint8_t>& colours) {
  const auto linear = linear_bytes();
  std::vector<uint8_t> made;
  made.reserve(colours.size() / 3 * 4);
  for (size_t i = 0; i < colours.size(); ++i) {
    made.push_back(linear[colours[i]]);
    if (i % 3 == 2) made.push_back(255);
  }
  return made;
}

std::vector<float> joint_positions(const HeadMesh& mesh) {
  std::vector<float> positions;
  for (const MeshJoint& joint : mesh.joints) {
    positions.insert(positions.end(), joint.position.begin(), joint.position.end());
  }
  return to_file_axes(positions, [](const float*) { return 0.1; });
}

// The attributes of vertices that joints move, and the skin, whose first joint is node 1.
std::array<std::string, 2> add_skin(const HeadMesh& mesh, const std::vector<float>& places, GlbWriter& glb) {
  std::vector<uint8_t> joints;
  std::vector<float> weights, inverse;  // the inverse of each joint's place, column by column
  for (const VertexJoints& vertex : mesh.vertex_joints) {
    joints.insert(joints.end(), vertex.joints.begin(), vertex.joints.end());
    weights.insert(weights.end(), vertex.weights.begin(), vertex.weights.end());
  }
  std::string nodes;
  for (size_t i = 0; i < mesh.joints.size(); ++i) {
    for (size_t k = 0; k < 12; ++k) inverse.push_back(k % 5 == 0 ? 1.0f : 0.0f);
    for (size_t axis = 0; axis < 3; ++axis) inverse.push_back(0.0f - places[3 * i + axis]);
    inverse.push_back(1);
    nodes += concatenate(i == 0 ? "" : ",", i + 1);
  }
  const size_t at_joints = glb.add_accessor(joints, 4, GlbComponent::kUnsignedByte, GlbTarget::kVertices, "", true);
  const size_t at_weights = glb.add_accessor(weights, 4, GlbComponent::kFloat, GlbTarget::kVertices);
  const size_t matrices = glb.add_accessor(inverse, 16, GlbComponent::kFloat, GlbTarget::kNone);
  return {concatenate(",\"JOINTS_0\":", at_joints, ",\"WEIGHTS_0\":", at_weights),
          concatenate(",\"skins\":[{\"inverseBindMatrices\":", matrices, ",\"skeleton\":1,\"joints\":[", nodes, "]}]")};
}

// The nodes of joints, from node 1 on.
std::string joint_nodes(const HeadMesh& mesh, const std::vector<float>& places) {
  std::string nodes;
  for (size_t i = 0; i < mesh.joints.size(); ++i) {
    std::array<float, 3> from_parent = {places[3 * i], places[3 * i + 1], places[3 * i + 2]};
    if (const int parent = mesh.joints[i].parent; parent >= 0) {
      for (size_t axis = 0; axis < 3; ++axis) from_parent[axis] -= places[3 * size_t(parent) + axis];
    }
    std::string children;
    for (size_t k = i + 1; k < mesh.joints.size(); ++k) {
      if (mesh.joints[k].parent == int(i)) children += concatenate(children.empty() ? "" : ",", k + 1);
    }
    nodes +=
        concatenate(",{\"name\":\"", mesh.joints[i].name, "\",\"translation\":", glb_numbers(from_parent.data(), 3),
                    children.empty() ? "" : ",\"children\":[" + children + ']', '}');
  }
  return nodes;
}

}  // namespace

std::vector<uint8_t> mesh_as_glb(const HeadMesh& mesh, const std::vector<uint8_t>& texture) {
  GlbWriter glb;
  const std::vector<float> positions = positions_in_file(mesh);
  const std::string limits = glb_limits(positions, 3);
  std::string attributes =
      concatenate("\"POSITION\":", glb.add_accessor(positions, 3, GlbComponent::kFloat, GlbTarget::kVertices, limits));
  if (!mesh.normals.empty()) {
    attributes += concatenate(",\"NORMAL\":",
                              glb.add_accessor(normals_in_file(mesh), 3, GlbComponent::kFloat, GlbTarget::kVertices));
  }
  std::string of_material, of_file;
  if (!mesh.texture_coordinates.empty()) {
    attributes += concatenate(
        ",\"TEXCOORD_0\":", glb.add_accessor(mesh.texture_coordinates, 2, GlbComponent::kFloat, GlbTarget::kVertices));
  }
  if (!texture.empty()) {
    of_material = ",\"baseColorTexture\":{\"index\":0}";
  } else if (!mesh.colours.empty()) {
    attributes += concatenate(",\"COLOR_0\":", glb.add_accessor(linear_colours(mesh.colours), 4,
                                                                GlbComponent::kUnsignedByte, GlbTarget::kVertices));
  }
  std::string skin, nodes = "{\"name\":\"head\",\"mesh\":0}";
  if (!mesh.joints.empty()) {
    const std::vector<float> places = joint_positions(mesh);
    const auto [of_vertices, of_file_skin] = add_skin(mesh, places, glb);
    attributes += of_vertices;
    skin = of_file_skin;
    nodes = "{\"name\":\"head\",\"mesh\":0,\"skin\":0}" + joint_nodes(mesh, places);
  }
  std::string targets, names;
  for (const MorphTarget& target : mesh.morph_targets) {
    const std::vector<float> moves = to_file_axes(target.deltas, [](const float*) { return 0.1; });
    const bool is_sparse = target.vertices.size() < mesh.vertex_count();
    const size_t accessor =
        glb.add_sparse(mesh.vertex_count(), target.vertices, moves, glb_limits(moves, 3, is_sparse));
    targets += concatenate(targets.empty() ? "" : ",", "{\"POSITION\":", accessor, '}');
    names += concatenate(names.empty() ? "" : ",", '"', target.name, '"');
  }
  std::string of_primitive, of_mesh;
  if (!targets.empty()) {
    of_primitive = ",\"targets\":[" + targets + ']';
    of_mesh = ",\"extras\":{\"targetNames\":[" + names + "]}";
  }
  const size_t indices = glb.add_accessor(mesh.triangles, 1, GlbComponent::kUnsignedInt, GlbTarget::kIndices);
  if (!texture.empty()) {
    const size_t view = glb.add_view(texture.data(), texture.size(), GlbTarget::kNone);
    of_file =
        concatenate(",\"images\":[{\"bufferView\":", view, ",\"mimeType\":\"image/", is_png(texture) ? "png" : "jpeg",
                    "\"}],\"samplers\":[{\"magFilter\":9729,\"minFilter\":9987}]"  // linear, with mip maps
                    ",\"textures\":[{\"sampler\":0,\"source\":0}]");
  }
  return glb.finish(
      concatenate(of_file,
                  ",\"materials\":[{\"name\":\"head\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,1],"
                  "\"metallicFactor\":0,\"roughnessFactor\":0.75",
                  of_material, "}}],\"meshes\":[{\"name\":\"head\",\"primitives\":[{\"attributes\":{", attributes,
                  "},\"indices\":", indices, ",\"material\":0", of_primitive, "}]", of_mesh, "}]", skin, ",\"nodes\":[",
                  nodes, "],\"scenes\":[{\"nodes\":[0", mesh.joints.empty() ? "" : ",1", "]}],\"scene\":0"));
}

}  // namespace maq::head
