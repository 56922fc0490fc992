// Files of priors that Python wrote, and what is wrong with others.
#include <gtest/gtest.h>

#include <cmath>

#include "head/files/prior_file.h"
#include "head/files/stored_numbers.h"
#include "support/checked_file_damage.h"
#include "support/expect_error.h"
#include "support/peak_memory.h"
#include "support/samples/tiny_head.h"

namespace prior_files {
namespace {

using namespace maq::head;  // NOLINT
using checked_file_damage::repair;

const std::string kPath = tiny_head::kFolder + "/priors/int8.maqp";

// Whatever a prior holds may be used.
void use(const HeadPrior& prior) {
  FieldCodes codes;
  codes.shape.assign(size_t(prior.shape_codes()), 1);
  codes.colour.assign(size_t(prior.colour_codes()), -1);
  const FieldWeights weights = prior.bases.combine(codes);
  for (const float value : weights.values()) ASSERT_TRUE(std::isfinite(value));
  for (const auto* values : {&prior.anchors.template_points, &prior.anchors.mean, &prior.anchors.linear}) {
    for (const float value : *values) ASSERT_TRUE(std::isfinite(value));
  }
}
void open_and_use(const void* bytes, size_t count) { use(read_prior(bytes, count, "prior.maqp")); }

// Next of the numbers that numpy found.
struct Expected {
  std::vector<float> values;
  size_t at = 0;
  float next() { return values.at(at++); }
  template <class Values>
  void expect(const Values& found, float tolerance = 0) {
    for (const auto value : found) ASSERT_NEAR(value, next(), tolerance) << at;
  }
};

TEST(PriorFiles, OfEachFormatAreWhatPythonReadsInThem) {
  for (const char* format : {"float32", "float16", "int8"}) {
    SCOPED_TRACE(format);
    const std::string name = std::string("priors/") + format;
    const HeadPrior prior = read_prior_file(tiny_head::kFolder + "/" + name + ".maqp");
    Expected expected{tiny_head::read_floats(name + ".f32")};
    FieldShape shape;
    shape.octaves = 2, shape.width = 12, shape.geometry_layers = 3, shape.feature = 5, shape.surface_width = 10;
    shape.personal_geometry_layers = 2;
    EXPECT_EQ(prior.bases.shape(), shape);
    const FieldWeights weights = prior.bases.combine(tiny_head::kCodes);
    for (int layer = 0; layer < shape.layers(); ++layer) {
      const ConstFieldLayer one = weights.layer(layer);
      for (int output = 0; output < one.outputs; ++output) {
        for (int i = 0; i < one.inputs; ++i) ASSERT_NEAR(one.row(output)[i], expected.next(), 1e-5) << layer;
      }
      for (int output = 0; output < one.outputs; ++output) ASSERT_NEAR(one.bias[output], expected.next(), 1e-5);
    }
    EXPECT_EQ(prior.sharpness, expected.next());
    for (const maq::Vec3& v : {prior.cut.point, prior.cut.normal}) expected.expect(std::array{v.x, v.y, v.z});
    expected.expect(prior.bounds.min);
    expected.expect(prior.bounds.max);
    EXPECT_EQ(prior.anchors.count(), 7u);
    expected.expect(prior.anchors.template_points);
    expected.expect(prior.anchors.mean);
    expected.expect(prior.anchors.linear);
    expected.expect(prior.anchors.sigma);
    ASSERT_EQ(prior.landmarks.size(), 2u);
    EXPECT_EQ(prior.landmarks[0].name, "nose_tip");
    EXPECT_EQ(prior.landmarks[1].name, "chin");
    for (const NamedPoint& place : prior.landmarks) expected.expect(place.template_point);
    EXPECT_EQ(expected.at, expected.values.size());
  }
}

TEST(PriorFiles, CutOrChangedAtAnyBitAreRefused) {
  checked_file_damage::expect_all_damage_noticed(read_text(kPath), MAQ_ERROR_BAD_BUNDLE, open_and_use);
}

TEST(PriorFiles, WithRandomChangesAndRightChecksAreRefusedOrHarmless) {
  for (const char* format : {"float32", "float16", "int8"}) {
    const std::string whole = read_text(tiny_head::kFolder + "/priors/" + format + ".maqp");
    checked_file_damage::expect_random_changes_harmless(whole, sizeof(PriorFileHead), 4'000, MAQ_ERROR_BAD_BUNDLE,
                                                        open_and_use);
  }
}

TEST(PriorFiles, ThatLieAreRefusedThoughTheirChecksAreRight) {
  const auto refuse = [](const char* text, maq_status status, auto&& change) {
    std::string bytes = read_text(kPath);
    PriorFileHead head;
    std::memcpy(&head, bytes.data(), sizeof head);
    change(head);
    std::memcpy(bytes.data(), &head, sizeof head);
    repair(bytes);
    expect_error(status, text, [&] { read_prior(bytes.data(), bytes.size(), "prior.maqp"); });
  };
  constexpr maq_status kBad = MAQ_ERROR_BAD_BUNDLE;
  refuse("is not a prior", kBad, [](auto& head) { head.start.magic[5] = 'X'; });
  refuse("version 2", MAQ_ERROR_UNSUPPORTED, [](auto& head) { head.start.version = 2; });
  refuse("damaged", kBad, [](auto& head) { head.start.head_bytes = 64; });
  refuse("should have", kBad, [](auto& head) { head.start.file_bytes = uint64_t(1) << 63; });
  refuse("cannot be: 4294967295", kBad, [](auto& head) { head.shape.width = ~0u; });
  refuse("octaves", MAQ_ERROR_UNSUPPORTED, [](auto& head) { head.shape.octaves = 9; });
  refuse("smoothing", MAQ_ERROR_UNSUPPORTED, [](auto& head) { head.shape.smoothing = NAN; });
  refuse("what it claims takes", kBad, [](auto& head) { head.shape.width = 256; });
  refuse("what it claims takes", kBad, [](auto& head) { head.shape_codes = 512; });
  refuse("more than a prior", kBad, [](auto& head) { head.shape_codes = 513; });
  refuse("more than a prior", kBad, [](auto& head) { head.colour_codes = ~0u; });
  refuse("more than a prior", kBad, [](auto& head) { head.anchors = 16385; });
  refuse("more than a prior", kBad, [](auto& head) { head.landmarks = 257; });
  refuse("belong to nothing", kBad, [](auto& head) { head.landmarks = 1; });
  refuse("in a way", kBad, [](auto& head) { head.constant_format = StoredFormat::kInt8; });
  refuse("in a way", kBad, [](auto& head) { head.bases_format = StoredFormat(3); });
  refuse("in a way", kBad, [](auto& head) { head.zero[1] = 1; });
  refuse("in a way", kBad, [](auto& head) { head.more_zeros[3] = 1; });
  refuse("sharpness", kBad, [](auto& head) { head.sharpness = NAN; });
  refuse("cut", kBad, [](auto& head) { head.cut_normal[0] = 1; });
  refuse("domain", kBad, [](auto& head) { head.bounds_max[2] = INFINITY; });
}

TEST(PriorFiles, WithNumbersThatAreNotFiniteAreRefused) {
  const std::string whole = read_text(tiny_head::kFolder + "/priors/float32.maqp");
  for (const float value : {float(NAN), INFINITY, -2e6f}) {
    std::string bytes = whole;
    std::memcpy(bytes.data() + sizeof(PriorFileHead), &value, sizeof value);
    repair(bytes);
    expect_error(MAQ_ERROR_BAD_BUNDLE, "not finite", [&] { open_and_use(bytes.data(), bytes.size()); });
  }
}

TEST(PriorFiles, ThatClaimMuchTakeNoMemory) {
  std::string bytes = read_text(kPath);
  PriorFileHead head;
  std::memcpy(&head, bytes.data(), sizeof head);
  head.shape = {8, 256, 8, 256, 256, 8, 8, 8, 2e-4f};
  head.shape_codes = head.colour_codes = 512;  // 4 GB of bases
  std::memcpy(bytes.data(), &head, sizeof head);
  repair(bytes);
  const double grown = peak_memory_growth_mib([&] {
    expect_error(MAQ_ERROR_BAD_BUNDLE, "what it claims takes", [&] { open_and_use(bytes.data(), bytes.size()); });
  });
  EXPECT_LT(grown, 8);
  expect_error(MAQ_ERROR_UNSUPPORTED, "at most", [&] { read_prior(bytes.data(), kMaxPriorFileBytes + 1, "a"); });
}

TEST(PriorFiles, ThatAreNotThereOrEmptyAreAStatus) {
  expect_error(MAQ_ERROR_NOT_FOUND, "none.maqp", [] { read_prior_file(tiny_head::kFolder + "/none.maqp"); });
  expect_error(MAQ_ERROR_BAD_BUNDLE, "too short", [] { read_prior(nullptr, 0, "prior.maqp"); });
}

TEST(PriorFiles, HalvesAreThoseOfIeee754) {
  const std::pair<uint16_t, float> exact[] = {
      {0, 0.0f},          {0x3c00, 1.0f},     {0xc000, -2.0f},      {0x7bff, 65504.0f},
      {0x0001, 0x1p-24f}, {0x0400, 0x1p-14f}, {0x03ff, 0x3ffp-24f}, {0x3555, 0x1.554p-2f}};
  for (const auto& [half, value] : exact) {
    EXPECT_EQ(half_to_float(half), value);
    EXPECT_EQ(float_to_half(value), half);
  }
  for (int half = 0; half < 65536; ++half) {
    const float value = half_to_float(uint16_t(half));
    if (std::isnan(value)) continue;
    ASSERT_EQ(float_to_half(value), half);
  }
  EXPECT_EQ(float_to_half(0x1.002p0f), 0x3c00);  // half of the last place: to even
  EXPECT_EQ(float_to_half(0x1.006p0f), 0x3c02);
  EXPECT_EQ(float_to_half(0x1.ffep0f), 0x4000);  // a carry
  EXPECT_EQ(float_to_half(65519.0f), 0x7bff);
  EXPECT_EQ(float_to_half(65520.0f), 0x7c00);
  EXPECT_EQ(float_to_half(-INFINITY), 0xfc00);
  EXPECT_EQ(float_to_half(0x1p-25f), 0);
  EXPECT_EQ(float_to_half(0x1.8p-25f), 1);
  EXPECT_EQ(float_to_half(0x1p-149f), 0);
  EXPECT_TRUE(std::isnan(half_to_float(float_to_half(NAN))));
}

}  // namespace
}  // namespace prior_files
