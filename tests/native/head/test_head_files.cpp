// Heads on disk: what is written is what is read; damage; disks
// that are full.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>

#include "head/files/head_file.h"
#include "head/files/stored_numbers.h"
#include "support/checked_file_damage.h"
#include "support/expect_error.h"
#include "support/file_size_limit.h"
#include "support/peak_memory.h"
#include "support/samples/tiny_head.h"
#include "support/temp_folder.h"

namespace head_files {
namespace {

using namespace maq::head;  // NOLINT

// With numbers that float16 holds.
StoredHead example(const FieldShape& shape, int anchors, int cameras) {
  StoredHead head{FieldWeights(shape)};
  int count = 0;
  const auto next = [&] { return float(count++ * 37 % 257 - 128) / 64; };
  for (int layer = 0; layer < shape.layers(); ++layer) {
    const FieldLayer one = head.weights.layer(layer);
    for (int output = 0; output < one.outputs; ++output) {
      for (int i = 0; i < one.inputs; ++i) one.row(output)[i] = next();
      one.bias[output] = next();
    }
  }
  head.codes = {{0.1f, -1.7f, 2.3f}, {0.3f, -0.01f}};
  head.code_factor = {0.5f, -0.125f, 0.75f, 0.25f, 0.0625f, 1};
  for (int i = 0; i < cameras; ++i) {
    HeadCamera camera;
    const Mat3 facing_y = {1, 0, 0, 0, 0, -1, 0, 1, 0};
    camera.head_to_camera = {i % 2 == 0 ? facing_y : facing_y * Mat3{0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1},
                             {0.1, -0.2, 9.5 + i}};
    camera.focal_px = 812.25 + i, camera.cx_px = 319.5, camera.cy_px = 239.5;
    camera.width_px = 640, camera.height_px = 480;
    head.cameras.push_back(camera);
  }
  head.scale = {0.0987, 0.004, ScaleSource::kGiven};
  head.sharpness = 150.5f;
  head.cut = {{0, 0.1, -1.3}, {0, 0.6, -0.8}};
  head.bounds = {{-1.5f, -1.75f, -2}, {1.5f, 1.875f, 2.125f}};
  for (int i = 0; i < anchors; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      head.anchors.template_points.push_back(next());
      head.anchors.points.push_back(next());
    }
    head.anchors.sigma.push_back(0.015625f);
  }
  head.landmarks = {{"nose_tip", {0, -1.25f, 0.1f}}, {"chin", {0, -0.9f, -0.9f}}};
  for (size_t i = 0; i < 32; ++i) head.prior_sha256[i] = uint8_t(7 * i);
  return head;
}
StoredHead example() {
  FieldShape shape;
  shape.octaves = 1, shape.width = 6, shape.geometry_layers = 2, shape.feature = 2, shape.surface_width = 5;
  shape.surface_layers = 1, shape.personal_geometry_layers = 1;
  return example(shape, 5, 2);
}

std::string bytes_of(const StoredHead& head) {
  const std::vector<uint8_t> bytes = head_file_bytes(head);
  return {bytes.begin(), bytes.end()};
}

// Whatever a head holds may be used.
void open_and_use(const void* bytes, size_t count) {
  const StoredHead head = read_head(bytes, count, "a.maqh");
  ASSERT_EQ(stored_head_fault(head), "");
  head_file_bytes(head);
}

TEST(HeadFiles, HoldAllOfAHead) {
  const TempFolder folder;
  const StoredHead head = example();
  write_head_file(head, folder.file("a.maqh"));
  const StoredHead again = read_head_file(folder.file("a.maqh"));
  EXPECT_EQ(again.weights.shape(), head.weights.shape());
  EXPECT_EQ(again.weights.values(), head.weights.values());
  EXPECT_EQ(again.codes.shape, head.codes.shape);
  EXPECT_EQ(again.codes.colour, head.codes.colour);
  EXPECT_EQ(again.code_factor, head.code_factor);
  ASSERT_EQ(again.cameras.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    const HeadCamera &found = again.cameras[i], &camera = head.cameras[i];
    EXPECT_EQ(found.head_to_camera.rotation, camera.head_to_camera.rotation);
    EXPECT_EQ(length(found.head_to_camera.translation - camera.head_to_camera.translation), 0);
    EXPECT_EQ(found.focal_px, camera.focal_px);
    EXPECT_EQ(found.cx_px, 319.5);
    EXPECT_EQ(found.cy_px, 239.5);
    EXPECT_EQ(found.width_px, 640);
    EXPECT_EQ(found.height_px, 480);
  }
  EXPECT_EQ(again.scale.metres_per_unit, 0.0987);
  EXPECT_EQ(again.scale.sigma, 0.004);
  EXPECT_EQ(again.scale.source, ScaleSource::kGiven);
  EXPECT_EQ(again.sharpness, 150.5f);
  EXPECT_EQ(length(again.cut.point - head.cut.point) + length(again.cut.normal - head.cut.normal), 0);
  EXPECT_EQ(again.bounds.min, head.bounds.min);
  EXPECT_EQ(again.bounds.max, head.bounds.max);
  EXPECT_EQ(again.anchors.template_points, head.anchors.template_points);
  EXPECT_EQ(again.anchors.points, head.anchors.points);
  EXPECT_EQ(again.anchors.sigma, head.anchors.sigma);
  ASSERT_EQ(again.landmarks.size(), 2u);
  EXPECT_EQ(again.landmarks[1].name, "chin");
  EXPECT_EQ(again.landmarks[1].template_point, head.landmarks[1].template_point);
  EXPECT_EQ(again.prior_sha256, head.prior_sha256);
  EXPECT_EQ(bytes_of(again), read_text(folder.file("a.maqh")));
}

TEST(HeadFiles, HoldATextureOnlyWhereThereIsOne) {
  StoredHead head = example();
  const size_t without = bytes_of(head).size();
  head.texture = {512, {0xFF, 0xD8, 0xFF, 7, 8, 9, 10}};
  std::string bytes = bytes_of(head);
  EXPECT_EQ(bytes.size(), without + 8 + 7);
  const StoredHead read = read_head(bytes.data(), bytes.size(), "a.maqh");
  EXPECT_EQ(read.texture.side_px, 512);
  EXPECT_EQ(read.texture.jpeg, head.texture.jpeg);
  EXPECT_EQ(read.landmarks.size(), 2u);
  const auto refuse = [&](const char* text, uint32_t side_px, uint32_t count) {
    std::string changed = bytes;
    std::memcpy(changed.data() + without, &side_px, 4);
    std::memcpy(changed.data() + without + 4, &count, 4);
    checked_file_damage::repair(changed);
    expect_error(MAQ_ERROR_UNREADABLE, text, [&] { read_head(changed.data(), changed.size(), "a.maqh"); });
  };
  refuse("a texture of 0 pixels", 0, 7);
  refuse("a texture of 4096 pixels", 4096, 7);
  refuse("0 bytes", 512, 0);
  refuse("ends before", 512, ~0u);
  refuse("belong to nothing", 512, 6);
  head.texture.side_px = 0;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "its texture has 0 pixels", [&] { bytes_of(head); });
}

TEST(HeadFiles, AreTheOnesThatPythonReads) {
  EXPECT_TRUE(bytes_of(example()) == read_text(tiny_head::kFolder + "/example.maqh"))
      << "the file of an example is not what lies in " << tiny_head::kFolder;
}

TEST(HeadFiles, OfVersion1AreReadAndDoNotSayHowSureTheyAre) {
  const std::string bytes = read_text(tiny_head::kFolder + "/example_version_1.maqh");
  StoredHead head = read_head(bytes.data(), bytes.size(), "a.maqh");
  EXPECT_TRUE(head.code_factor.empty());
  EXPECT_EQ(head.codes.shape, example().codes.shape);
  head.code_factor = example().code_factor;
  EXPECT_EQ(bytes_of(head), bytes_of(example())) << "all else is as it is now";
  std::string changed = bytes;
  HeadFileHead start;
  std::memcpy(&start, changed.data(), sizeof start);
  start.has_code_factor = 1;
  std::memcpy(changed.data(), &start, sizeof start);
  checked_file_damage::repair(changed);
  expect_error(MAQ_ERROR_UNREADABLE, "in a way that version 1",
               [&] { read_head(changed.data(), changed.size(), "a.maqh"); });
}

TEST(HeadFiles, OfTheDefaultFieldTakeLessThan64KiB) {
  StoredHead head = example({}, 800, 5);
  head.codes.shape.resize(64), head.codes.colour.resize(32);
  head.code_factor.resize(64 * 65 / 2);
  EXPECT_LT(head_file_bytes(head).size(), size_t(64) << 10);
}

TEST(HeadFiles, RoundWeightsToHalvesAndNothingElse) {
  StoredHead head = example();
  head.weights.layer(0).row(0)[0] = 0.1f;
  head.anchors.points[0] = 0.3f;
  const StoredHead again = read_head(head_file_bytes(head).data(), head_file_bytes(head).size(), "a.maqh");
  EXPECT_EQ(again.weights.layer(0).row(0)[0], half_to_float(float_to_half(0.1f)));
  EXPECT_NEAR(again.anchors.points[0], 0.3f, 1e-4);
  EXPECT_EQ(again.codes.shape[1], -1.7f);
}

TEST(HeadFiles, WithoutCodesCamerasAnchorsAndPlacesAreRead) {
  StoredHead head = example();
  head.codes = {};
  head.code_factor = {};
  head.cameras.clear();
  head.anchors = {};
  head.landmarks.clear();
  const std::string bytes = bytes_of(head);
  const StoredHead again = read_head(bytes.data(), bytes.size(), "a.maqh");
  EXPECT_TRUE(again.codes.shape.empty());
  EXPECT_TRUE(again.cameras.empty());
  EXPECT_EQ(again.anchors.count(), 0u);
  EXPECT_TRUE(again.landmarks.empty());
}

TEST(HeadFiles, OfHeadsWithAFaultAreNotWritten) {
  const TempFolder folder;
  const auto refuse = [&](const char* text, auto&& change) {
    StoredHead head = example();
    change(head);
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, text, [&] { write_head_file(head, folder.file("a.maqh")); });
  };
  refuse("weights is not finite", [](StoredHead& h) { h.weights.layer(1).bias[0] = NAN; });
  refuse("beyond 65504", [](StoredHead& h) { h.weights.layer(1).bias[0] = 70000; });
  refuse("512 codes", [](StoredHead& h) { h.codes.shape.resize(513); });
  refuse("codes", [](StoredHead& h) { h.codes.colour[0] = INFINITY; });
  refuse("covariance of its codes", [](StoredHead& h) { h.code_factor.pop_back(); });
  refuse("covariance of its codes", [](StoredHead& h) { h.code_factor[1] = NAN; });
  refuse("covariance of its codes", [](StoredHead& h) { h.code_factor[1] = 1.5f; });
  refuse("257 cameras", [](StoredHead& h) { h.cameras.resize(257, h.cameras[0]); });
  refuse("0 x 480", [](StoredHead& h) { h.cameras[1].width_px = 0; });
  refuse("focal length of 0", [](StoredHead& h) { h.cameras[1].focal_px = 0; });
  refuse("principal point", [](StoredHead& h) { h.cameras[1].cy_px = NAN; });
  refuse("rotation", [](StoredHead& h) { h.cameras[0].head_to_camera.rotation[4] += 1e-4; });
  refuse("rotation", [](StoredHead& h) { h.cameras[0].head_to_camera.rotation = {1, 0, 0, 0, 1, 0, 0, 0, -1}; });
  refuse("rotation", [](StoredHead& h) { h.cameras[0].head_to_camera.rotation[0] = NAN; });
  refuse("finite position", [](StoredHead& h) { h.cameras[0].head_to_camera.translation.z = NAN; });
  refuse("scale is 0", [](StoredHead& h) { h.scale.metres_per_unit = 0; });
  refuse("sigma nan", [](StoredHead& h) { h.scale.sigma = NAN; });
  refuse("source 3", [](StoredHead& h) { h.scale.source = ScaleSource(3); });
  refuse("sharpness", [](StoredHead& h) { h.sharpness = 0; });
  refuse("cut plane", [](StoredHead& h) { h.cut.normal = {}; });
  refuse("domain", [](StoredHead& h) { h.bounds.max[0] = 9; });
  refuse("one size", [](StoredHead& h) { h.anchors.points.pop_back(); });
  refuse("anchors is not finite", [](StoredHead& h) { h.anchors.points[2] = NAN; });
  refuse("anchors is not finite", [](StoredHead& h) { h.anchors.sigma[2] = -1; });
  refuse("two of its landmarks", [](StoredHead& h) { h.landmarks[1].name = "nose_tip"; });
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(HeadFiles, CutOrChangedAtAnyBitAreRefused) {
  checked_file_damage::expect_all_damage_noticed(bytes_of(example()), MAQ_ERROR_UNREADABLE, open_and_use);
}

TEST(HeadFiles, WithRandomChangesAndRightChecksAreRefusedOrHarmless) {
  checked_file_damage::expect_random_changes_harmless(bytes_of(example()), sizeof(HeadFileHead), 10'000,
                                                      MAQ_ERROR_UNREADABLE, open_and_use);
}

TEST(HeadFiles, ThatLieAreRefusedThoughTheirChecksAreRight) {
  const std::string whole = bytes_of(example());
  const auto refuse = [&](const char* text, maq_status status, auto&& change) {
    std::string bytes = whole;
    HeadFileHead head;
    std::memcpy(&head, bytes.data(), sizeof head);
    change(head);
    std::memcpy(bytes.data(), &head, sizeof head);
    checked_file_damage::repair(bytes);
    expect_error(status, text, [&] { read_head(bytes.data(), bytes.size(), "a.maqh"); });
  };
  constexpr maq_status kBad = MAQ_ERROR_UNREADABLE;
  refuse("is not a head", kBad, [](auto& head) { std::memcpy(head.start.magic, kPriorFileMagic, 8); });
  refuse("version 7", MAQ_ERROR_UNSUPPORTED, [](auto& head) { head.start.version = 7; });
  refuse("should have", kBad, [](auto& head) { head.start.file_bytes -= 1; });
  refuse("cannot be", kBad, [](auto& head) { head.shape.feature = 1 << 30; });
  refuse("surface width", MAQ_ERROR_UNSUPPORTED, [](auto& head) { head.shape.surface_width = 257; });
  refuse("weights that it claims", kBad, [](auto& head) { head.shape.width = 256; });
  refuse("more than a head", kBad, [](auto& head) { head.shape_codes = 513; });
  refuse("more than a head", kBad, [](auto& head) { head.cameras = ~0u; });
  refuse("more than a head", kBad, [](auto& head) { head.anchors = ~0u; });
  refuse("more than a head", kBad, [](auto& head) { head.landmarks = 300; });
  refuse("ends before", kBad, [](auto& head) { head.cameras = 256; });
  refuse("ends before", kBad, [](auto& head) { head.anchors = 16384; });
  refuse("belong to nothing", kBad, [](auto& head) { head.landmarks = 1; });
  refuse("in a way", kBad, [](auto& head) { head.zero = 1; });
  refuse("in a way", kBad, [](auto& head) { head.has_texture = 2; });
  refuse("in a way", kBad, [](auto& head) { head.has_code_factor = 2; });
  refuse("ends before", kBad, [](auto& head) { head.has_texture = 1; });
  refuse("source 9", kBad, [](auto& head) { head.scale_source = 9; });
  refuse("scale is inf", kBad, [](auto& head) { head.metres_per_unit = INFINITY; });
  refuse("cut plane", kBad, [](auto& head) { head.cut_point[1] = NAN; });
  refuse("domain", kBad, [](auto& head) { head.bounds_min[1] = -INFINITY; });
  refuse("sharpness", kBad, [](auto& head) { head.sharpness = -1; });
}

TEST(HeadFiles, ThatClaimMuchTakeNoMemory) {
  std::string bytes = bytes_of(example());
  HeadFileHead head;
  std::memcpy(&head, bytes.data(), sizeof head);
  head.shape = {8, 256, 8, 256, 256, 8, 8, 8, 2e-4f};
  std::memcpy(bytes.data(), &head, sizeof head);
  checked_file_damage::repair(bytes);
  const double grown = peak_memory_growth_mib(
      [&] { expect_error(MAQ_ERROR_UNREADABLE, "claims", [&] { open_and_use(bytes.data(), bytes.size()); }); });
  EXPECT_LT(grown, 2);
  expect_error(MAQ_ERROR_UNSUPPORTED, "at most", [&] { read_head(bytes.data(), kMaxHeadFileBytes + 1, "a"); });
  expect_error(MAQ_ERROR_UNREADABLE, "too short", [] { read_head(nullptr, 0, "a.maqh"); });
  expect_error(MAQ_ERROR_NOT_FOUND, "none.maqh", [] { read_head_file("none.maqh"); });
}

}  // namespace
}  // namespace head_files
