// The shipped template head registered to heads of the shipped prior: the mean head and random samples.
#include <gtest/gtest.h>

#include <random>
#include <utility>

#include "head/files/prior_file.h"
#include "head/files/template_file.h"
#include "head/reconstruction/registered_template.h"
#include "support/temp_folder.h"

namespace wrapped_surface_tests {
namespace {

using namespace maq::head;  // NOLINT
using maq::WorkerThreads;

const std::string kBundle = MAQ_TEST_MODELS "/heads-int8/";

const HeadPrior& shipped_prior() {
  static const HeadPrior prior = read_prior_file(kBundle + "prior.maqp");
  return prior;
}

const HeadTemplate& shipped_template() {
  static const HeadTemplate head = [] {
    const std::string bytes = read_text(kBundle + "template.maqt");
    return read_template(bytes.data(), bytes.size(), "template.maqt");
  }();
  return head;
}

// With codes of so many standard deviations, drawn by `seed`.
StoredHead drawn_head(double sigmas, unsigned seed) {
  const HeadPrior& prior = shipped_prior();
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  FieldCodes codes;
  for (int k = 0; k < prior.shape_codes(); ++k) codes.shape.push_back(float(sigmas) * normal(random));
  for (int k = 0; k < prior.colour_codes(); ++k) codes.colour.push_back(float(sigmas) * normal(random));
  StoredHead head(prior.bases.combine(codes));
  head.codes = codes;
  head.cut = prior.cut, head.bounds = prior.bounds, head.landmarks = prior.landmarks;
  const HeadAnchors& anchors = prior.anchors;
  head.anchors = {anchors.template_points, anchors.mean, anchors.sigma};
  for (size_t i = 0; i < anchors.mean.size(); ++i) {
    for (size_t k = 0; k < codes.shape.size(); ++k) {
      head.anchors.points[i] += anchors.linear[i * codes.shape.size() + k] * codes.shape[k];
    }
  }
  return head;
}

TemplateRegistration registration_of(const StoredHead& head) {
  WorkerThreads threads(2);
  TemplateRegistration registration;
  registered_template(head, shipped_template(), threads, &registration);
  return registration;
}

TEST(RegisteredTemplate, LiesOnTheFieldAndHasItsTemplatePoints) {
  for (const auto& [sigmas, seed] : {std::pair{0.0, 1u}, {0.7, 2u}, {0.5, 3u}, {0.7, 4u}, {0.9, 5u}, {1.0, 9u}}) {
    const TemplateRegistration registration = registration_of(drawn_head(sigmas, seed));
    EXPECT_LT(registration.mean_distance, 0.003) << seed;
    EXPECT_LT(registration.mean_residual, 0.03) << seed;
    EXPECT_NEAR(registration.scale, 1, 0.2) << seed;
    EXPECT_EQ(registration.flipped, 0u) << seed;
  }
}

TEST(RegisteredTemplate, IsAMeshOfTheTemplatesVerticesInTrueDecimetres) {
  const HeadTemplate& onto = shipped_template();
  StoredHead head = drawn_head(0.5, 5);
  WorkerThreads threads(1);
  const HeadMesh mesh = registered_template(head, onto, threads);
  EXPECT_EQ(mesh.triangles, onto.triangles);
  EXPECT_EQ(mesh.texture_coordinates, onto.texture_coordinates);
  ASSERT_EQ(mesh.vertex_count(), onto.vertex_points.size());
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  ASSERT_EQ(mesh.colours.size(), mesh.positions.size());
  ASSERT_EQ(mesh.morph_targets.size(), onto.actions.size());
  head.scale.metres_per_unit *= 2;
  const HeadMesh twice = registered_template(head, onto, threads);
  for (size_t i = 0; i < mesh.positions.size(); ++i) ASSERT_NEAR(twice.positions[i], 2 * mesh.positions[i], 1e-4);
  for (size_t k = 0; k < mesh.morph_targets.size(); ++k) {
    const MorphTarget &one = mesh.morph_targets[k], &two = twice.morph_targets[k];
    ASSERT_EQ(one.name, onto.actions[k].name);
    ASSERT_EQ(one.vertices, two.vertices);
    ASSERT_EQ(one.deltas.size(), 3 * one.vertices.size());
    ASSERT_GE(one.vertices.size(), onto.actions[k].points.size());
    for (size_t i = 0; i < one.deltas.size(); ++i) ASSERT_NEAR(two.deltas[i], 2 * one.deltas[i], 1e-5);
  }
}

TEST(RegisteredTemplate, IsTheSameForAnyNumberOfThreads) {
  const StoredHead head = drawn_head(0.8, 6);
  WorkerThreads one(1), three(3);
  const HeadMesh mesh = registered_template(head, shipped_template(), one);
  const HeadMesh again = registered_template(head, shipped_template(), three);
  EXPECT_EQ(mesh.positions, again.positions);
  EXPECT_EQ(mesh.normals, again.normals);
  EXPECT_EQ(mesh.colours, again.colours);
}

}  // namespace
}  // namespace wrapped_surface_tests
