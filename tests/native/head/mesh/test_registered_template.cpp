// The shipped template head registered to heads of the shipped prior: the mean head and random samples.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "head/files/prior_file.h"
#include "head/files/template_file.h"
#include "head/reconstruction/head_texture.h"
#include "head/reconstruction/registered_template.h"
#include "image/files/image_file.h"
#include "support/expect_error.h"
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
  ASSERT_EQ(mesh.morph_targets.size(), onto.actions.size() + 15) << "and visemes";
  head.scale.metres_per_unit *= 2;
  const HeadMesh twice = registered_template(head, onto, threads);
  for (size_t i = 0; i < mesh.positions.size(); ++i) ASSERT_NEAR(twice.positions[i], 2 * mesh.positions[i], 1e-4);
  for (size_t k = 0; k < onto.actions.size(); ++k) {
    const MorphTarget &one = mesh.morph_targets[k], &two = twice.morph_targets[k];
    ASSERT_EQ(one.name, onto.actions[k].name);
    ASSERT_EQ(one.vertices, two.vertices);
    ASSERT_EQ(one.deltas.size(), 3 * one.vertices.size());
    ASSERT_GE(one.vertices.size(), onto.actions[k].points.size());
    for (size_t i = 0; i < one.deltas.size(); ++i) ASSERT_NEAR(two.deltas[i], 2 * one.deltas[i], 1e-5);
  }
}

float weight_of(const HeadMesh& mesh, size_t vertex, const char* joint) {
  const VertexJoints& of = mesh.vertex_joints[vertex];
  for (size_t k = 0; k < 4; ++k) {
    if (of.weights[k] > 0 && mesh.joints[of.joints[k]].name == joint) return of.weights[k];
  }
  return 0;
}

TEST(RegisteredTemplate, HasJointsThatMoveItsParts) {
  const HeadTemplate& onto = shipped_template();
  StoredHead head = drawn_head(0.7, 7);
  WorkerThreads threads(2);
  const HeadMesh mesh = registered_template(head, onto, threads);
  std::vector<std::string> names;
  for (const MeshJoint& joint : mesh.joints) names.push_back(joint.name);
  EXPECT_EQ(names, (std::vector<std::string>{"Neck", "Head", "Jaw", "LeftEye", "RightEye"}));
  EXPECT_GT(mesh.joints[3].position[0], 0.2f) << "left is the person's";
  EXPECT_LT(mesh.joints[4].position[0], -0.2f);
  EXPECT_GT(mesh.joints[1].position[2], mesh.joints[0].position[2] + 0.6f) << "the head's joint is above the neck's";
  ASSERT_EQ(mesh.vertex_joints.size(), mesh.vertex_count());
  double stays = 0, follows = 0;
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    float sum = 0;
    for (const float weight : mesh.vertex_joints[i].weights) sum += weight;
    ASSERT_NEAR(sum, 1, 1e-5f);
    const size_t point = onto.vertex_points[i];
    const float* const p = &onto.points[3 * point];
    switch (onto.kinds[point]) {
      case TemplateKind::kEye:
      case TemplateKind::kEyeFront:
        EXPECT_EQ(weight_of(mesh, i, p[0] > 0 ? "LeftEye" : "RightEye"), 1) << i;
        // An eyeball turns in its socket: no point of it is far from the radius.
        {
          const auto& middle = mesh.joints[p[0] > 0 ? 3 : 4].position;
          const float* const at = &mesh.positions[3 * i];
          EXPECT_NEAR(std::hypot(at[0] - middle[0], at[1] - middle[1], at[2] - middle[2]), 0.155f, 0.05f);
        }
        break;
      case TemplateKind::kTongue: EXPECT_GT(weight_of(mesh, i, "Jaw"), 0.6f) << i; break;
      default: break;
    }
    if (p[2] > 0.2f) stays = std::max(stays, double(weight_of(mesh, i, "Jaw")));
    if (p[2] < -1.45f) follows = std::max(follows, double(weight_of(mesh, i, "Head")));
  }
  EXPECT_LT(stays, 0.05) << "nothing above the eyes moves with the jaw";
  EXPECT_LT(follows, 0.05) << "the neck's end stays";
}

// The jaw's joint, turned as jawOpen turns the lower teeth, brings vertices to about where jawOpen moves them.
TEST(RegisteredTemplate, TheJawTurnsAsJawOpenDoes) {
  const HeadTemplate& onto = shipped_template();
  StoredHead head = drawn_head(0, 1);
  WorkerThreads threads(2);
  const HeadMesh mesh = registered_template(head, onto, threads);
  const auto open = std::find_if(mesh.morph_targets.begin(), mesh.morph_targets.end(),
                                 [](const MorphTarget& target) { return target.name == "jawOpen"; });
  ASSERT_NE(open, mesh.morph_targets.end());
  const auto& axis = mesh.joints[2].position;
  const double angle = 22.28 * 3.14159265 / 180;  // of the lower teeth
  double off = 0, moved = 0;
  for (size_t k = 0; k < open->vertices.size(); ++k) {
    const size_t i = open->vertices[k];
    const double weight = double(weight_of(mesh, i, "Jaw"));
    const double y = double(mesh.positions[3 * i + 1] - axis[1]), z = double(mesh.positions[3 * i + 2] - axis[2]);
    const double by = weight * (std::cos(angle) * y - std::sin(angle) * z - y);
    const double bz = weight * (std::sin(angle) * y + std::cos(angle) * z - z);
    off += std::hypot(double(open->deltas[3 * k + 1]) - by, double(open->deltas[3 * k + 2]) - bz);
    moved += std::hypot(double(open->deltas[3 * k + 1]), double(open->deltas[3 * k + 2]));
  }
  EXPECT_LT(off, 0.25 * moved);
}

TEST(RegisteredTemplate, HasTheHeadsTextureInItsOwnCoordinates) {
  const HeadTemplate& onto = shipped_template();
  StoredHead head = drawn_head(0.5, 9);
  WorkerThreads threads(2);
  TemplateRegistration registration;
  const HeadMesh mesh = registered_template(head, onto, threads, &registration);
  EXPECT_TRUE(texture_of_template(head, onto, mesh, registration, threads).empty()) << "the head has none";
  TextureOptions options;
  options.side_px = 256;
  head.texture = make_texture(head, {}, options, threads);  // without a photo: the network's colours
  maq::Frame texture;
  maq::decode_image(texture_of_template(head, onto, mesh, registration, threads), "The texture", texture);
  ASSERT_EQ(texture.image.width_px, 512);
  double off = 0, count = 0;
  for (size_t vertex = 0; vertex < mesh.vertex_count(); ++vertex) {
    const size_t point = onto.vertex_points[vertex];
    if (onto.kinds[point] != TemplateKind::kSurface || onto.points[3 * point + 1] > -0.4f) continue;
    const auto along = [&](size_t axis) {
      return size_t(std::min(511.0f, 512 * onto.texture_coordinates[2 * vertex + axis]));
    };
    const auto& plane = texture.image.planes[0];
    const uint8_t* const bgr = plane.data + along(1) * plane.stride_bytes + 3 * along(0);
    for (size_t c = 0; c < 3; ++c) off += std::abs(double(bgr[2 - c]) - mesh.colours[3 * vertex + c]), ++count;
  }
  EXPECT_LT(off / count, 10) << "grey levels, on the front";
  head.texture.side_px = 300;  // a file that lies about its image
  expect_error(MAQ_ERROR_UNREADABLE, "but its file says 300",
               [&] { texture_of_template(head, onto, mesh, registration, threads); });
  head.texture = {256, {0xFF, 0xD8, 0xFF, 0xE0, 0, 1, 2, 3}};
  EXPECT_THROW(texture_of_template(head, onto, mesh, registration, threads), maq::Error);
}

TEST(RegisteredTemplate, VisemesAreSumsOfActions) {
  const HeadTemplate& onto = shipped_template();
  StoredHead head = drawn_head(0.3, 8);
  WorkerThreads threads(2);
  const HeadMesh mesh = registered_template(head, onto, threads);
  const auto target = [&](const std::string& name) -> const MorphTarget& {
    return *std::find_if(mesh.morph_targets.begin(), mesh.morph_targets.end(),
                         [&](const MorphTarget& one) { return one.name == name; });
  };
  EXPECT_TRUE(target("viseme_sil").vertices.empty());
  const auto largest = [](const MorphTarget& of) {
    float found = 0;
    for (const float delta : of.deltas) found = std::max(found, std::abs(delta));
    return found;
  };
  for (const char* name : {"PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "I", "O", "U"}) {
    EXPECT_GT(largest(target(std::string("viseme_") + name)), 0.01f) << name;
  }
  // The chin goes down by what the jaw has of it.
  const auto lowest = [](const MorphTarget& of) {
    float found = 0;
    for (size_t i = 2; i < of.deltas.size(); i += 3) found = std::min(found, of.deltas[i]);
    return found;
  };
  EXPECT_LT(lowest(target("viseme_aa")), 0.5f * lowest(target("jawOpen")));
  EXPECT_GT(lowest(target("viseme_SS")), 0.4f * lowest(target("jawOpen")));
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
