// Files of meshes: the bytes that other programs are shown to read (tests/python/heads/test_mesh_files.py), their
// structure, and their faults named.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "head/mesh/marching_cubes.h"
#include "head/mesh/mesh_cleanup.h"
#include "head/mesh/mesh_files.h"
#include "support/expect_error.h"
#include "support/file_size_limit.h"
#include "support/temp_folder.h"

namespace {

using maq::head::HeadMesh;
using nlohmann::json;

// An ellipsoid whose nose is at -y: 1.2 wide, 1.6 deep, 2 high, in decimetres, its colours by height.
HeadMesh example() {
  maq::WorkerThreads threads(1);
  maq::head::MarchingCubesOptions options;
  options.box_min = {-1.25f, -1.25f, -1.25f}, options.box_max = {1.25f, 1.25f, 1.25f}, options.cell = 0.25f;
  const auto ellipsoid = [](const float* x, const float* y, const float* z, float* f, size_t n) {
    for (size_t i = 0; i < n; ++i) {
      f[i] = std::sqrt(x[i] * x[i] / 0.36f + y[i] * y[i] / 0.64f + z[i] * z[i]) - 1;
    }
  };
  options.max_slope = 2;
  HeadMesh mesh = marching_cubes(ellipsoid, options, threads);
  set_normals(mesh);
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    const float* p = &mesh.positions[3 * i];
    for (const int value : {int(255 * (p[2] + 1.1f) / 2.2f), 128, 40}) mesh.colours.push_back(uint8_t(value));
    for (const float value : {p[0], p[1], p[2] + 0.5f}) mesh.template_points.push_back(value);
  }
  return mesh;
}

HeadMesh with_coordinates(HeadMesh mesh) {
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    for (const float value : {mesh.positions[3 * i] / 4 + 0.5f, 0.5f - mesh.positions[3 * i + 2] / 4}) {
      mesh.texture_coordinates.push_back(value);
    }
  }
  return mesh;
}

// Opens what is below and winks: of the second, nothing moves.
HeadMesh with_morph_targets(HeadMesh mesh) {
  maq::head::MorphTarget open{"jawOpen", {}, {}};
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    if (mesh.positions[3 * i + 2] > -0.4f) continue;
    open.vertices.push_back(uint32_t(i));
    open.deltas.insert(open.deltas.end(), {0, 0.02f, -0.2f});
  }
  mesh.morph_targets = {open, {"eyeBlinkLeft", {}, {}}};
  return mesh;
}

std::vector<uint8_t> small_png() {
  const std::string text = read_text(std::string(MAQ_TEST_DATA) + "/head_mesh/texture.png");
  return {text.begin(), text.end()};
}

uint32_t word(const std::vector<uint8_t>& bytes, size_t at) {
  uint32_t made = 0;
  std::memcpy(&made, bytes.data() + at, sizeof made);
  return made;
}

// The JSON of a GLB file whose lengths are right; its bytes begin at `begin`.
json parse_glb(const std::vector<uint8_t>& bytes, size_t& begin) {
  EXPECT_EQ(std::memcmp(bytes.data(), "glTF", 4), 0);
  EXPECT_EQ(word(bytes, 4), 2u);
  EXPECT_EQ(word(bytes, 8), bytes.size());
  const size_t json_size = word(bytes, 12);
  EXPECT_EQ(json_size % 4, 0u);
  EXPECT_EQ(std::memcmp(bytes.data() + 16, "JSON", 4), 0);
  begin = 20 + json_size + 8;
  EXPECT_EQ(std::memcmp(bytes.data() + begin - 4, "BIN\0", 4), 0);
  EXPECT_EQ(word(bytes, begin - 8) % 4, 0u);
  EXPECT_EQ(begin + word(bytes, begin - 8), bytes.size());
  json file = json::parse(bytes.begin() + 20, bytes.begin() + 20 + std::ptrdiff_t(json_size));
  EXPECT_EQ(file["buffers"].size(), 1u);
  EXPECT_EQ(file["buffers"][0]["byteLength"], bytes.size() - begin);
  size_t end = 0;
  for (const json& view : file["bufferViews"]) {
    EXPECT_EQ(view["byteOffset"].get<size_t>() % 4, 0u);
    EXPECT_GE(view["byteOffset"].get<size_t>(), end);
    end = view["byteOffset"].get<size_t>() + view["byteLength"].get<size_t>();
    EXPECT_LE(end, bytes.size() - begin);
  }
  return file;
}

std::vector<float> floats_of(const json& file, const std::vector<uint8_t>& bytes, size_t begin, size_t accessor) {
  const json& view = file["bufferViews"][file["accessors"][accessor]["bufferView"].get<size_t>()];
  std::vector<float> made(view["byteLength"].get<size_t>() / 4);
  std::memcpy(made.data(), bytes.data() + begin + view["byteOffset"].get<size_t>(), 4 * made.size());
  return made;
}

TEST(MeshFiles, AreTheOnesThatOtherProgramsRead) {
  const std::string kept = std::string(MAQ_TEST_DATA) + "/head_mesh/";
  const TempFolder folder;
  for (const char* name : {"example.glb", "example.obj", "example.ply"}) {
    write_mesh_file(example(), folder.file(name));
  }
  for (const char* name : {"textured.glb", "textured.obj"}) {
    write_mesh_file(with_coordinates(example()), folder.file(name), small_png());
  }
  write_mesh_file(with_morph_targets(with_coordinates(example())), folder.file("morphing.glb"));
  for (const char* name : {"morphing.glb", "example.glb", "example.obj", "example.mtl", "example.ply", "textured.glb",
                           "textured.obj", "textured.mtl", "textured.png"}) {
    EXPECT_TRUE(read_text(folder.file(name)) == read_text(kept + name)) << name << " is not what lies in " << kept;
  }
}

TEST(MeshFiles, AGlbHasWhatItsJsonSaysInMetresWithYUp) {
  const HeadMesh mesh = example();
  const auto bytes = maq::head::mesh_as_glb(mesh, {});
  size_t begin = 0;
  const json file = parse_glb(bytes, begin);
  const json& primitive = file["meshes"][0]["primitives"][0];
  const json& attributes = primitive["attributes"];
  EXPECT_FALSE(attributes.contains("TEXCOORD_0"));
  const json& accessor = file["accessors"][attributes["POSITION"].get<size_t>()];
  EXPECT_EQ(accessor["count"], mesh.vertex_count());
  const auto positions = floats_of(file, bytes, begin, attributes["POSITION"]);
  ASSERT_EQ(positions.size(), mesh.positions.size());
  for (size_t axis = 0; axis < 3; ++axis) {
    float low = positions[axis], high = low;
    for (size_t i = axis; i < positions.size(); i += 3)
      low = std::min(low, positions[i]), high = std::max(high, positions[i]);
    EXPECT_EQ(accessor["min"][axis].get<float>(), low);
    EXPECT_EQ(accessor["max"][axis].get<float>(), high);
  }
  EXPECT_NEAR(accessor["max"][1].get<double>(), 0.1, 0.002);  // z of the head frame
  EXPECT_NEAR(accessor["max"][2].get<double>(), 0.08, 0.002);
  for (size_t i = 0; i < positions.size(); i += 3) EXPECT_FLOAT_EQ(positions[i + 2], -mesh.positions[i + 1] / 10);
  const auto normals = floats_of(file, bytes, begin, attributes["NORMAL"]);
  for (size_t i = 0; i < normals.size(); i += 3) EXPECT_FLOAT_EQ(normals[i + 1], mesh.normals[i + 2]);
  const json& colours = file["accessors"][attributes["COLOR_0"].get<size_t>()];
  EXPECT_EQ(colours["componentType"], 5121);
  EXPECT_EQ(colours["normalized"], true);
  EXPECT_EQ(colours["type"], "VEC4");
  const size_t at = begin + file["bufferViews"][colours["bufferView"].get<size_t>()]["byteOffset"].get<size_t>();
  EXPECT_EQ(bytes[at + 1], 55);  // 128 of sRGB in linear light
  EXPECT_EQ(bytes[at + 3], 255);
  const json& indices = file["accessors"][primitive["indices"].get<size_t>()];
  EXPECT_EQ(indices["count"], mesh.triangles.size());
  EXPECT_EQ(indices["componentType"], 5125);
  EXPECT_EQ(file["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"], json::array({1, 1, 1, 1}));
}

TEST(MeshFiles, ATextureLiesInAGlbInPlaceOfVertexColours) {
  const auto texture = small_png();
  const auto bytes = maq::head::mesh_as_glb(with_coordinates(example()), texture);
  size_t begin = 0;
  const json file = parse_glb(bytes, begin);
  const json& attributes = file["meshes"][0]["primitives"][0]["attributes"];
  EXPECT_TRUE(attributes.contains("TEXCOORD_0"));
  EXPECT_FALSE(attributes.contains("COLOR_0"));
  EXPECT_EQ(file["images"][0]["mimeType"], "image/png");
  const json& view = file["bufferViews"][file["images"][0]["bufferView"].get<size_t>()];
  ASSERT_EQ(view["byteLength"], texture.size());
  EXPECT_EQ(std::memcmp(bytes.data() + begin + view["byteOffset"].get<size_t>(), texture.data(), texture.size()), 0);
}

TEST(MeshFiles, AGlbHasMorphTargetsWithNames) {
  const HeadMesh mesh = with_morph_targets(with_coordinates(example()));
  const auto bytes = maq::head::mesh_as_glb(mesh, {});
  size_t begin = 0;
  const json file = parse_glb(bytes, begin);
  const json& of_mesh = file["meshes"][0];
  EXPECT_EQ(of_mesh["extras"]["targetNames"], json::array({"jawOpen", "eyeBlinkLeft"}));
  const json& primitive = of_mesh["primitives"][0];
  EXPECT_TRUE(primitive["attributes"].contains("TEXCOORD_0")) << "without a texture, too";
  EXPECT_TRUE(primitive["attributes"].contains("COLOR_0"));
  ASSERT_EQ(primitive["targets"].size(), 2u);
  const json& moved = file["accessors"][primitive["targets"][0]["POSITION"].get<size_t>()];
  EXPECT_EQ(moved["count"], mesh.vertex_count());
  EXPECT_EQ(moved["sparse"]["count"], mesh.morph_targets[0].vertices.size());
  EXPECT_FLOAT_EQ(moved["min"][1].get<float>(), -0.02f);
  EXPECT_FLOAT_EQ(moved["min"][2].get<float>(), -0.002f);
  EXPECT_EQ(moved["max"], json::array({0.0, 0.0, 0.0})) << "of the vertices that stay";
  const size_t view = moved["sparse"]["indices"]["bufferView"].get<size_t>();
  EXPECT_EQ(word(bytes, begin + file["bufferViews"][view]["byteOffset"].get<size_t>()),
            mesh.morph_targets[0].vertices[0]);
  const json& still = file["accessors"][primitive["targets"][1]["POSITION"].get<size_t>()];
  EXPECT_FALSE(still.contains("sparse"));
  EXPECT_FALSE(still.contains("bufferView")) << "all of it is 0";
}

// The upper half turns with the second joint.
HeadMesh with_joints(HeadMesh mesh) {
  mesh.joints = {{"Neck", -1, {0, 0.1f, -1}}, {"Head", 0, {0, 0.2f, 0}}};
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    const float upper = std::clamp(mesh.positions[3 * i + 2], 0.0f, 1.0f);
    mesh.vertex_joints.push_back({{0, uint8_t(upper > 0 ? 1 : 0), 0, 0}, {1 - upper, upper, 0, 0}});
  }
  return mesh;
}

TEST(MeshFiles, AGlbHasASkinWhoseJointsAreWhereTheMeshHasThem) {
  const HeadMesh mesh = with_joints(example());
  const auto bytes = maq::head::mesh_as_glb(mesh, {});
  size_t begin = 0;
  const json file = parse_glb(bytes, begin);
  EXPECT_EQ(file["scenes"][0]["nodes"], json::array({0, 1}));
  const json& nodes = file["nodes"];
  ASSERT_EQ(nodes.size(), 3u);
  EXPECT_EQ(nodes[0]["skin"], 0);
  EXPECT_EQ(nodes[1]["name"], "Neck");
  EXPECT_EQ(nodes[1]["children"], json::array({2}));
  const float places[2][3] = {{0, -0.1f, -0.01f}, {0, 0, -0.02f}};  // metres, y up
  for (size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(nodes[1]["translation"][axis].get<double>(), double(places[0][axis]), 1e-7);
    EXPECT_NEAR(nodes[2]["translation"][axis].get<double>(), double(places[1][axis] - places[0][axis]), 1e-7);
  }
  const json& skin = file["skins"][0];
  EXPECT_EQ(skin["joints"], json::array({1, 2}));
  const auto inverse = floats_of(file, bytes, begin, skin["inverseBindMatrices"]);
  ASSERT_EQ(inverse.size(), 32u);
  for (size_t joint = 0; joint < 2; ++joint) {
    for (size_t k = 0; k < 16; ++k) {
      const double expected = k >= 12 && k < 15 ? -double(places[joint][k - 12]) : k % 5 == 0 ? 1 : 0;
      EXPECT_NEAR(double(inverse[16 * joint + k]), expected, 1e-7) << k;
    }
  }
  const json& attributes = file["meshes"][0]["primitives"][0]["attributes"];
  const auto weights = floats_of(file, bytes, begin, attributes["WEIGHTS_0"]);
  ASSERT_EQ(weights.size(), 4 * mesh.vertex_count());
  const json& joints = file["accessors"][attributes["JOINTS_0"].get<size_t>()];
  EXPECT_EQ(joints["componentType"], 5121);
  EXPECT_FALSE(joints.contains("normalized"));
}

TEST(MeshFiles, JointsThatDoNotFitAreASentence) {
  const HeadMesh right = with_joints(example());
  const auto refused = [&](auto&& change) {
    HeadMesh mesh = right;
    change(mesh);
    const TempFolder folder;
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "joints of the mesh",
                 [&] { write_mesh_file(mesh, folder.file("a.glb")); });
  };
  refused([](HeadMesh& mesh) { mesh.vertex_joints.pop_back(); });
  refused([](HeadMesh& mesh) { mesh.joints.pop_back(); });
  refused([](HeadMesh& mesh) { mesh.joints[1].parent = 1; });
  refused([](HeadMesh& mesh) { mesh.joints[1].parent = -1; });
  refused([](HeadMesh& mesh) { mesh.joints[0].position[1] = std::nanf(""); });
  refused([](HeadMesh& mesh) { mesh.vertex_joints[3].weights[0] = -0.5f; });
}

TEST(MeshFiles, WhatIsWrongWithAMeshIsSaidAndNoFileIsLeft) {
  const TempFolder folder;
  const auto refuse = [&](const char* text, const HeadMesh& mesh, const std::vector<uint8_t>& texture = {}) {
    for (const char* name : {"a.glb", "a.obj", "a.ply"}) {
      expect_error(MAQ_ERROR_INVALID_ARGUMENT, text, [&] { write_mesh_file(mesh, folder.file(name), texture); });
    }
  };
  refuse("no triangles", {});
  HeadMesh mesh = example();
  mesh.positions[7] = std::nanf("");
  refuse("a position of nan at vertex 2", mesh);
  mesh = example();
  mesh.normals[3] = INFINITY;
  refuse("a normal of inf at vertex 1", mesh);
  mesh = example();
  mesh.colours.pop_back();
  refuse("another length", mesh);
  mesh = example();
  mesh.triangles[4] = uint32_t(mesh.vertex_count());
  refuse("A triangle of the mesh has vertex", mesh);
  mesh = with_morph_targets(example());
  mesh.morph_targets[0].deltas.pop_back();
  refuse("The morph target jawOpen", mesh);
  mesh = with_morph_targets(example());
  mesh.morph_targets[0].vertices.back() = uint32_t(mesh.vertex_count());
  refuse("The morph target jawOpen", mesh);
  refuse("neither a JPEG nor a PNG", with_coordinates(example()), {1, 2, 3});
  refuse("no texture coordinates", example(), small_png());
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, ".glb, .obj or .ply",
               [&] { write_mesh_file(example(), folder.file("a.stl")); });
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(MeshFiles, AFullDiskLeavesNoFileOfAnObj) {
  const TempFolder folder;
  const HeadMesh mesh = with_coordinates(example());
  write_mesh_file(mesh, folder.file("b.obj"), small_png());
  const auto bytes = std::filesystem::file_size(folder.file("b.obj"));
  ASSERT_GT(bytes, std::filesystem::file_size(folder.file("b.png")) + 1);
  {
    const FileSizeLimit full(bytes - 1);
    expect_error(MAQ_ERROR_UNWRITABLE, "a.obj", [&] { write_mesh_file(mesh, folder.file("a.obj"), small_png()); });
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    EXPECT_EQ(entry.path().stem(), "b") << entry.path();
  }
}

TEST(MeshFiles, AFolderThatIsNotThereIsSaid) {
  const TempFolder folder;
  for (const char* name : {"no/a.glb", "no/a.obj", "no/a.ply"}) {
    expect_error(MAQ_ERROR_UNWRITABLE, name, [&] { write_mesh_file(example(), folder.file(name)); });
  }
}

}  // namespace
