// Meshes of heads with the template's vertices and morph targets, through the C API.
#include <gtest/gtest.h>

#include <maquette/maquette.hpp>

#include "support/samples/round_heads.h"
#include "support/temp_folder.h"

namespace api_head_topology_tests {
namespace {

using namespace round_heads;  // NOLINT

class ApiHeadTopology : public RoundHeads {};

TEST_F(ApiHeadTopology, TheTemplatesMeshHasItsVerticesOnTheHeadAndMorphTargets) {
  maquette::Head head = fitted();
  const float crown_m = float(head.landmark("crown").point_m[1]);
  const Mesh mesh(head);
  ASSERT_EQ(mesh.vertex_count, 14u * 25 + 1 + 12) << "as tests/native/generate/make_round_heads.py has it";
  EXPECT_EQ(mesh.triangle_count, 24u * (1 + 2 * 13) + 16);
  ASSERT_NE(mesh.texture_coordinates, nullptr);
  EXPECT_EQ(mesh.texture_jpeg, nullptr);
  for (uint32_t i = 0; i < 14 * 25 + 1; ++i) {
    const float *p = mesh.positions_m + 3 * i, *t = mesh.template_points_m + 3 * i, *n = mesh.normals + 3 * i;
    ASSERT_NEAR(t[1] * crown_m, p[1] * 0.121f, 1e-3f) << "on the template head the crown is at 121 mm";
    ASSERT_GT(n[0] * p[0] + n[1] * p[1] + n[2] * p[2], 0) << "outwards";
    ASSERT_GE(mesh.texture_coordinates[2 * i], 0);
    ASSERT_LE(mesh.texture_coordinates[2 * i], 1);
  }
  ASSERT_EQ(mesh.morph_target_count, 2u);
  EXPECT_STREQ(mesh.mesh.morph_target(1).name, "eyeBlinkLeft");
  const maq_head_morph_target jaw = mesh.mesh.morph_target(0);
  EXPECT_STREQ(jaw.name, "jawOpen");
  ASSERT_GT(jaw.vertex_count, 20u);
  for (uint32_t k = 0; k < jaw.vertex_count; ++k) {
    ASSERT_LT(jaw.vertices[k], mesh.vertex_count);
    ASSERT_TRUE(k == 0 || jaw.vertices[k] > jaw.vertices[k - 1]);
    ASSERT_NEAR(jaw.deltas_m[3 * k + 1], -0.015f, 0.003f) << "15 mm, by the size of the face";
  }
  maq_head_morph_target target{};
  target.struct_size = sizeof target;
  EXPECT_EQ(maq_head_mesh_get_morph_target(mesh.mesh.get(), 2, &target), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(Mesh(head, coarse).morph_target_count, 0u);
}

TEST_F(ApiHeadTopology, AnOpenedHeadTakesTheTemplateOfTheBundleThatIsNamed) {
  const TempFolder folder;
  maquette::Head head = fitted();
  head.save(folder.file("a.maqh"));
  maquette::Head opened = maquette::Head::open(context, folder.file("a.maqh"));
  maq_head_mesh_config options = maquette::default_head_mesh_config();
  maq_head_mesh* none = nullptr;
  options.model.bundle_path = "/nowhere";
  EXPECT_EQ(maq_head_mesh_create(opened.get(), &options, &none), MAQ_ERROR_NOT_FOUND);
  options.model.bundle_path = MAQ_TEST_DATA "/tiny_head/bundle";
  EXPECT_EQ(maq_head_mesh_create(opened.get(), &options, &none), MAQ_ERROR_UNSUPPORTED);
  expect_text("has no template head");
  options.model.bundle_path = kHeadsBundle;
  const Mesh made(opened, options), as_fitted = Mesh(head);
  ASSERT_EQ(made.vertex_count, as_fitted.vertex_count);
  for (uint32_t i = 0; i < 3 * made.vertex_count; ++i) {
    ASSERT_NEAR(made.positions_m[i], as_fitted.positions_m[i], 5e-4) << "weights are stored as float16";
  }
  maquette::HeadMesh(opened, options).save(folder.file("a.glb"));
  EXPECT_NE(read_text(folder.file("a.glb")).find("targetNames"), std::string::npos);
}

}  // namespace
}  // namespace api_head_topology_tests
