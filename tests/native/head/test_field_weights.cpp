// Shapes of the field network, its weights, and weights from bases and codes.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "head/field/weight_bases.h"
#include "head/reference_field.h"
#include "support/expect_error.h"

namespace field_weights {
namespace {

using namespace maq::head;        // NOLINT
using namespace reference_field;  // NOLINT

TEST(FieldWeights, TheDefaultShapeIsTheOneOfTheDocuments) {
  const FieldShape shape;
  EXPECT_EQ(shape.encoding(), 39);
  EXPECT_EQ(shape.layers(), 8);
  const int inputs[] = {39, 64, 64, 64, 64, 35, 64, 64}, outputs[] = {64, 64, 64, 64, 32, 64, 64, 6};
  const bool personal[] = {true, true, true, false, false, true, false, false};
  for (int layer = 0; layer < 8; ++layer) {
    EXPECT_EQ(shape.inputs(layer), inputs[layer]);
    EXPECT_EQ(shape.outputs(layer), outputs[layer]);
    EXPECT_EQ(shape.is_personal(layer), personal[layer]);
  }
}

TEST(FieldWeights, ShapesBeyondTheLimitsAreRefused) {
  const auto refused = [](const std::string& text, auto&& change) {
    FieldShape shape;
    change(shape);
    expect_error(MAQ_ERROR_UNSUPPORTED, text, [&] { FieldWeights weights(shape); });
    expect_error(MAQ_ERROR_UNSUPPORTED, text, [&] { FieldEngine engine(shape, FieldIsa::kPortable); });
    expect_error(MAQ_ERROR_UNSUPPORTED, text, [&] { WeightBases bases(shape, 1, 1); });
  };
  constexpr int kHuge = std::numeric_limits<int>::max();
  for (const int value : {-1, 9, kHuge}) refused("octaves", [&](FieldShape& shape) { shape.octaves = value; });
  for (const int value : {0, -64, 257, kHuge}) {
    refused("width", [&](FieldShape& shape) { shape.width = value; });
    refused("surface width", [&](FieldShape& shape) { shape.surface_width = value; });
  }
  for (const int value : {0, -1, 9, kHuge}) {
    refused("geometry layers", [&](FieldShape& shape) { shape.geometry_layers = value; });
    refused("surface layers", [&](FieldShape& shape) { shape.surface_layers = value; });
  }
  for (const int value : {-1, 257, kHuge}) refused("feature", [&](FieldShape& shape) { shape.feature = value; });
  for (const int value : {-1, 5}) {
    refused("personal geometry", [&](FieldShape& shape) { shape.personal_geometry_layers = value; });
    refused("personal surface", [&](FieldShape& shape) { shape.personal_surface_layers = value; });
  }
  for (const float value : {0.0f, -1.0f, 2.0f, NAN, INFINITY}) {
    refused("smoothing", [&](FieldShape& shape) { shape.smoothing = value; });
  }
  for (const int codes : {-1, kMaxFieldCodes + 1, kHuge}) {
    expect_error(MAQ_ERROR_UNSUPPORTED, "codes", [&] { WeightBases bases({}, codes, 1); });
    expect_error(MAQ_ERROR_UNSUPPORTED, "codes", [&] { WeightBases bases({}, 1, codes); });
  }
}

TEST(FieldWeights, LayersDoNotOverlapAndAreAligned) {
  FieldShape shape;
  shape.width = 37;
  FieldWeights weights(shape);
  size_t end = 0;
  for (int index = 0; index < shape.layers(); ++index) {
    const FieldLayer layer = weights.layer(index);
    EXPECT_EQ(size_t(layer.weights - weights.values().data()), end);
    EXPECT_EQ(reinterpret_cast<uintptr_t>(layer.weights) % 64, 0u);
    EXPECT_GE(layer.stride, size_t(layer.inputs));
    EXPECT_EQ(layer.bias, layer.row(layer.outputs));
    end = weights.place(index).end;
    EXPECT_LE(size_t(layer.bias - weights.values().data()) + size_t(layer.outputs), end);
  }
  EXPECT_EQ(weights.values().size(), end);
}

WeightBases random_bases(const FieldShape& shape, FieldIsa isa) {
  WeightBases bases(shape, 5, 3, isa);
  std::mt19937 random(31);
  std::normal_distribution<float> normal;
  bases.constant() = random_weights(shape, 30);
  for (int layer = 0; layer < shape.layers(); ++layer) {
    if (!shape.is_personal(layer)) continue;
    for (int code = 0; code < (layer < shape.first_surface_layer() ? 5 : 3); ++code) {
      const FieldLayer basis = bases.basis_layer(layer, code);
      for (int o = 0; o < basis.outputs; ++o) {
        for (int i = 0; i < basis.inputs; ++i) basis.row(o)[i] = normal(random);
        basis.bias[o] = normal(random);
      }
    }
  }
  return bases;
}

TEST(FieldWeights, AreTheConstantAndCodesTimesBases) {
  FieldShape shape;
  shape.width = 48;
  const FieldCodes codes{{0.5f, -1.0f, 2.0f, 0.0f, 0.25f}, {1.5f, -0.5f, 3.0f}};
  for (const FieldIsa isa : supported_field_isas()) {
    WeightBases bases = random_bases(shape, isa);
    const FieldWeights weights = bases.combine(codes);
    for (int layer = 0; layer < shape.layers(); ++layer) {
      const ConstFieldLayer got = weights.layer(layer);
      const FieldLayer constant = bases.constant().layer(layer);
      const std::vector<float>& of_layer = layer < shape.first_surface_layer() ? codes.shape : codes.colour;
      for (int o = 0; o < got.outputs; ++o) {
        double expected = double(constant.row(o)[1]), bias = double(constant.bias[o]);
        for (size_t k = 0; shape.is_personal(layer) && k < of_layer.size(); ++k) {
          expected += double(of_layer[k]) * double(bases.basis_layer(layer, int(k)).row(o)[1]);
          bias += double(of_layer[k]) * double(bases.basis_layer(layer, int(k)).bias[o]);
        }
        EXPECT_NEAR(got.row(o)[1], expected, 1e-5);
        EXPECT_NEAR(got.bias[o], bias, 1e-5);
      }
    }
  }
}

TEST(FieldWeights, TheGradientByCodesIsThatOfFiniteDifferences) {
  FieldShape shape;
  shape.width = 48;
  const FieldCodes codes{{0.5f, -1.0f, 2.0f, 0.0f, 0.25f}, {1.5f, -0.5f, 3.0f}};
  for (const FieldIsa isa : supported_field_isas()) {
    WeightBases bases = random_bases(shape, isa);
    const FieldWeights gradient = random_weights(shape, 33);  // of a loss that is linear in the weights
    const auto loss = [&](const FieldCodes& at) {
      const FieldWeights weights = bases.combine(at);
      double sum = 0;
      for (size_t i = 0; i < weights.values().size(); ++i) {
        sum += double(weights.values()[i]) * double(gradient.values()[i]);
      }
      return sum;
    };
    FieldCodes by_codes;
    bases.code_gradient(gradient, by_codes);
    ASSERT_EQ(by_codes.shape.size(), 5u);
    ASSERT_EQ(by_codes.colour.size(), 3u);
    for (size_t k = 0; k < 8; ++k) {
      FieldCodes moved = codes;
      (k < 5 ? moved.shape[k] : moved.colour[k - 5]) += 1.0f;
      const double expected = loss(moved) - loss(codes);
      EXPECT_NEAR(k < 5 ? by_codes.shape[k] : by_codes.colour[k - 5], expected, 1e-3 * std::abs(expected) + 1e-2);
    }
  }
}

TEST(FieldWeights, CodesOfOtherBasesAreRefused) {
  WeightBases bases({}, 2, 1);
  FieldWeights weights((FieldShape()));
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "3 shape codes", [&] { bases.combine({{1, 2, 3}, {1}}, weights); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "0 colour codes", [&] { bases.combine({{1, 2}, {}}, weights); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "finite", [&] { bases.combine({{1, NAN}, {1}}, weights); });
  expect_error(MAQ_ERROR_INTERNAL, "no basis", [&] { bases.basis_layer(3, 0); });
  expect_error(MAQ_ERROR_INTERNAL, "no basis", [&] { bases.basis_layer(0, 2); });
  FieldShape other;
  other.width = 48;
  FieldWeights others(other);
  FieldCodes codes;
  expect_error(MAQ_ERROR_INTERNAL, "two shapes", [&] { bases.combine({{1, 2}, {1}}, others); });
  expect_error(MAQ_ERROR_INTERNAL, "two shapes", [&] { bases.code_gradient(others, codes); });
  expect_error(MAQ_ERROR_INTERNAL, "two shapes", [&] { weights.add(others); });
}

}  // namespace
}  // namespace field_weights
