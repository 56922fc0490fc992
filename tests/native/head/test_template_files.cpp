// Files of the template head that Python wrote, and what is wrong with others.
#include <gtest/gtest.h>

#include <cmath>

#include "head/files/file_format.h"
#include "head/files/template_file.h"
#include "support/checked_file_damage.h"
#include "support/expect_error.h"
#include "support/peak_memory.h"
#include "support/samples/tiny_head.h"

namespace template_files {
namespace {

using namespace maq::head;  // NOLINT
using checked_file_damage::repair;

const std::string kPath = tiny_head::kFolder + "/template.maqt";

void open_and_use(const void* bytes, size_t count) {
  const HeadTemplate head = read_template(bytes, count, "template.maqt");
  EXPECT_EQ(template_fault(head), "");
}

TEST(TemplateFiles, AreWhatPythonWrote) {
  const std::string bytes = read_text(kPath);
  const HeadTemplate head = read_template(bytes.data(), bytes.size(), kPath);
  ASSERT_EQ(head.point_count(), 5u);
  const float points[15] = {0, 0, 1, 1, 0, -0.5f, -0.5f, 0.75f, -0.5f, -0.5f, -0.75f, -0.5f, 0, 0, 0.25f};
  for (size_t i = 0; i < 15; ++i) EXPECT_NEAR(head.points[i], points[i], 1e-6) << i;
  EXPECT_EQ(head.kinds[3], TemplateKind::kSurface);
  EXPECT_EQ(head.kinds[4], TemplateKind::kTeeth);
  EXPECT_EQ(head.vertex_points, (std::vector<uint32_t>{0, 1, 2, 3, 0, 4}));
  const float uv[12] = {0, 0, 0.25f, 1, 0.5f, 1, 0.75f, 1, 1, 0, 0.5f, 0.5f};
  for (size_t i = 0; i < 12; ++i) EXPECT_NEAR(head.texture_coordinates[i], uv[i], 1e-5) << i;
  EXPECT_EQ(head.triangles, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3, 4, 3, 1, 1, 3, 2}));
  ASSERT_EQ(head.actions.size(), 2u);
  EXPECT_EQ(head.actions[0].name, "jawOpen");
  EXPECT_EQ(head.actions[0].points, (std::vector<uint32_t>{0, 3}));
  const float moves[6] = {0, 0.05f, -0.25f, 0.001f, 0, -0.3f};
  for (size_t i = 0; i < 6; ++i) EXPECT_NEAR(head.actions[0].deltas[i], moves[i], 1e-6) << i;
  EXPECT_EQ(head.actions[1].name, "noseSneerLeft");
  EXPECT_TRUE(head.actions[1].points.empty());
}

TEST(TemplateFiles, CutOrChangedAtAnyBitAreRefused) {
  checked_file_damage::expect_all_damage_noticed(read_text(kPath), MAQ_ERROR_BAD_BUNDLE, open_and_use);
}

TEST(TemplateFiles, WithRandomChangesAndRightChecksAreRefusedOrHarmless) {
  checked_file_damage::expect_random_changes_harmless(read_text(kPath), sizeof(TemplateFileHead), 4'000,
                                                      MAQ_ERROR_BAD_BUNDLE, open_and_use);
}

TEST(TemplateFiles, ThatLieAreRefusedThoughTheirChecksAreRight) {
  const auto refuse = [](const char* text, maq_status status, auto&& change) {
    std::string bytes = read_text(kPath);
    TemplateFileHead head;
    std::memcpy(&head, bytes.data(), sizeof head);
    change(head, bytes);
    std::memcpy(bytes.data(), &head, sizeof head);
    repair(bytes);
    expect_error(status, text, [&] { read_template(bytes.data(), bytes.size(), "template.maqt"); });
  };
  constexpr maq_status kBad = MAQ_ERROR_BAD_BUNDLE;
  // After the head: 5 points, their kinds, 6 vertices, their coordinates, 4 triangles, actions.
  constexpr size_t kKinds = sizeof(TemplateFileHead) + 30, kVertices = kKinds + 5, kTriangles = kVertices + 12 + 24,
                   kActions = kTriangles + 24;
  refuse("is not a template", kBad, [](auto& head, auto&) { head.start.magic[5] = 'X'; });
  refuse("version 2", MAQ_ERROR_UNSUPPORTED, [](auto& head, auto&) { head.start.version = 2; });
  refuse("more than a template", kBad, [](auto& head, auto&) { head.points = 65536; });
  refuse("more than a template", kBad, [](auto& head, auto&) { head.triangles = ~0u; });
  refuse("more than a template", kBad, [](auto& head, auto&) { head.actions = 257; });
  refuse("ends before", kBad, [](auto& head, auto&) { head.triangles = 100; });
  refuse("belong to nothing", kBad, [](auto& head, auto&) { head.actions = 1; });
  refuse("in steps of", kBad, [](auto& head, auto&) { head.point_step_dm = NAN; });
  refuse("in steps of", kBad, [](auto& head, auto&) { head.move_step_dm = 1; });
  refuse("of a kind", kBad, [](auto&, auto& bytes) { bytes[kKinds] = 7; });
  refuse("does not have", kBad, [](auto&, auto& bytes) { bytes[kVertices] = 5; });
  refuse("does not have", kBad, [](auto&, auto& bytes) { bytes[kTriangles] = 6; });
  refuse("letters", kBad, [](auto&, auto& bytes) { bytes[kActions + 1] = '"'; });
  refuse("moves points", kBad, [](auto&, auto& bytes) { bytes[kActions + 1 + 7 + 2] = 3; });  // 3 and 3 again
}

TEST(TemplateFiles, ThatClaimMuchTakeNoMemory) {
  std::string bytes = read_text(kPath);
  TemplateFileHead head;
  std::memcpy(&head, bytes.data(), sizeof head);
  head.points = head.vertices = 65535, head.triangles = 1 << 18;
  std::memcpy(bytes.data(), &head, sizeof head);
  repair(bytes);
  const double grown = peak_memory_growth_mib(
      [&] { expect_error(MAQ_ERROR_BAD_BUNDLE, "ends before", [&] { open_and_use(bytes.data(), bytes.size()); }); });
  EXPECT_LT(grown, 4);
  expect_error(MAQ_ERROR_UNSUPPORTED, "at most", [&] { read_template(bytes.data(), kMaxTemplateFileBytes + 1, "a"); });
}

}  // namespace
}  // namespace template_files
