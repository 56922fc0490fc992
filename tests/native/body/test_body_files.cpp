// Files of bodies that Python wrote, and what is wrong with others.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "body/model/body_file.h"
#include "support/checked_file_damage.h"
#include "support/expect_error.h"
#include "support/peak_memory.h"
#include "support/samples/shipped_body.h"

namespace body_files {
namespace {

using namespace maq::body;  // NOLINT
using checked_file_damage::repair;

const std::string kPath = std::string(MAQ_TEST_DATA) + "/tiny_body/body.maqb";

void open_and_use(const void* bytes, size_t count) {
  const BodyModel body = read_body(bytes, count, "body.maqb");
  EXPECT_EQ(model_fault(body), "");
}

TEST(BodyFiles, AreWhatPythonWrote) {
  const std::string bytes = read_text(kPath);
  const BodyModel body = read_body(bytes.data(), bytes.size(), kPath);
  ASSERT_EQ(body.joints.size(), 3u);
  EXPECT_EQ(body.joints[2].name, "head");
  EXPECT_EQ(body.joints[2].parent, 1);
  EXPECT_NEAR(body.joints[1].rest.z, 0.25, 1e-7);
  EXPECT_NEAR(body.joints[2].basis[0].x, 0.02, 1e-5);
  ASSERT_EQ(body.vertices.size(), 4u);
  EXPECT_NEAR(body.vertices[1].rest.x, 0.5, 5e-5);
  EXPECT_NEAR(body.vertices[3].basis[0].z, 0.125, 1e-5);
  EXPECT_NEAR(body.vertices[3].weights[0], 0.5, 0.003);
  EXPECT_EQ(body.vertices[3].joints[1], 1);
  EXPECT_NEAR(body.keypoints[32].rest.x, 0.5, 5e-5);
  EXPECT_EQ(body.triangles, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2}));
  EXPECT_EQ(body.surface_nodes, 2);
  EXPECT_EQ(body.surface[3].triangle, 3);
  EXPECT_NEAR(body.surface[3].fractions[2], 0.4, 1e-6);
  EXPECT_EQ(body.surface[95].triangle, kNoTriangle);
  EXPECT_NEAR(body.prior.mean[2], 0.2, 1e-7);
  EXPECT_NEAR(body.prior.high[3], 1.4, 1e-6);
  EXPECT_EQ(body.prior.precision[3], -1);
}

TEST(BodyFiles, TheShippedOneHasItsJointsAndIsSmall) {
  EXPECT_EQ(shipped_body::model().joints.size(), 19u);
  EXPECT_EQ(shipped_body::model().shape_count, 10u);
  EXPECT_GE(shipped_body::model().find_joint("lower_arm.R"), 0);
  EXPECT_LT(read_text(std::string(MAQ_TEST_MODELS) + "/body/body.maqb").size(), 1'000'000u);
}

TEST(BodyFiles, CutOrChangedAtAnyBitAreRefused) {
  checked_file_damage::expect_all_damage_noticed(read_text(kPath), MAQ_ERROR_BAD_BUNDLE, open_and_use);
}

TEST(BodyFiles, WithRandomChangesAndRightChecksAreRefusedOrHarmless) {
  checked_file_damage::expect_random_changes_harmless(read_text(kPath), sizeof(BodyFileHead), 4'000,
                                                      MAQ_ERROR_BAD_BUNDLE, open_and_use);
}

TEST(BodyFiles, ThatLieAreRefusedThoughTheirChecksAreRight) {
  const auto refuse = [](const char* text, maq_status status, auto&& change) {
    std::string bytes = read_text(kPath);
    BodyFileHead head;
    std::memcpy(&head, bytes.data(), sizeof head);
    change(head, bytes);
    std::memcpy(bytes.data(), &head, sizeof head);
    repair(bytes);
    expect_error(status, text, [&] { read_body(bytes.data(), bytes.size(), "body.maqb"); });
  };
  constexpr maq_status kBad = MAQ_ERROR_BAD_BUNDLE;
  // After the head: a step, the names and parents of three joints, their places, and 37 points.
  constexpr size_t kNames = sizeof(BodyFileHead) + 4, kParents = kNames + 7, kJoints = kNames + 8 + 7 + 6,
                   kPoints = kJoints + 18 + 18, kWeightsAt = kPoints + 2 * 6 * 37 + 4 * 37,
                   kTriangles = kWeightsAt + 4 * 37, kSurface = kTriangles + 24, kPrior = kSurface + 4 * 96;
  const auto write = [](std::string& bytes, size_t at, float value) { std::memcpy(bytes.data() + at, &value, 4); };
  refuse("is not a body", kBad, [](auto& head, auto&) { head.start.magic[5] = 'X'; });
  refuse("version 2", MAQ_ERROR_UNSUPPORTED, [](auto& head, auto&) { head.start.version = 2; });
  refuse("25 joints", kBad, [](auto& head, auto&) { head.joints = 25; });
  refuse("13 shapes", kBad, [](auto& head, auto&) { head.shapes = 13; });
  refuse("vertices", kBad, [](auto& head, auto&) { head.vertices = 1 << 20; });
  refuse("must have 33", kBad, [](auto& head, auto&) { head.keypoints = 17; });
  refuse("in steps of", kBad, [](auto& head, auto&) { head.point_step_m = NAN; });
  refuse("nodes of its surface", kBad, [](auto& head, auto&) { head.surface_nodes = 65; });
  refuse("ends before", kBad, [](auto& head, auto&) { head.triangles = 4'000; });
  refuse("belong to nothing", kBad, [](auto& head, auto& bytes) {
    bytes += "more";
    head.start.file_bytes += 4;
  });
  refuse("the name of a joint", kBad, [](auto&, auto& bytes) { bytes[kNames + 1] = '"'; });
  refuse("has the parent", kBad, [](auto&, auto& bytes) { bytes[kParents] = 0; });
  refuse("weights sum to", kBad, [](auto&, auto& bytes) { ++bytes[kWeightsAt]; });
  refuse("weights of joints", kBad, [](auto&, auto& bytes) { bytes[kWeightsAt - 1] = 3; });
  refuse("vertices that it does not have", kBad, [](auto&, auto& bytes) { bytes[kTriangles] = 4; });
  refuse("triangles that it does not have", kBad, [](auto&, auto& bytes) { bytes[kSurface] = 4; });
  refuse("not within", kBad, [&](auto&, auto& bytes) { write(bytes, kPrior, 3); });
  refuse("finite", kBad, [&](auto&, auto& bytes) { write(bytes, kPrior, NAN); });
  refuse("not symmetric", kBad, [&](auto&, auto& bytes) { write(bytes, kPrior + 3 * 24 + 4, 2); });
  refuse("positive definite", kBad, [&](auto&, auto& bytes) { write(bytes, kPrior + 3 * 24, -4); });
}

TEST(BodyFiles, ThatClaimMuchTakeNoMemory) {
  std::string bytes = read_text(kPath);
  BodyFileHead head;
  std::memcpy(&head, bytes.data(), sizeof head);
  head.vertices = 20'000, head.triangles = 40'000, head.surface_nodes = 64;
  std::memcpy(bytes.data(), &head, sizeof head);
  repair(bytes);
  const double grown = peak_memory_growth_mib(
      [&] { expect_error(MAQ_ERROR_BAD_BUNDLE, "ends before", [&] { open_and_use(bytes.data(), bytes.size()); }); });
  EXPECT_LT(grown, 4);
  expect_error(MAQ_ERROR_UNSUPPORTED, "at most", [&] { read_body(bytes.data(), kMaxBodyFileBytes + 1, "a"); });
}

}  // namespace
}  // namespace body_files
