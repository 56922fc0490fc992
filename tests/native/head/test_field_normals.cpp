// The engine's second derivatives, those that a loss on normals needs, against float64.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "head/field/field_engine.h"
#include "head/reference_field.h"

namespace field_normals {
namespace {

using namespace maq::head;        // NOLINT
using namespace reference_field;  // NOLINT

struct Normals {
  Normals(const FieldWeights& weights, FieldIsa isa, size_t count)
      : points(random_columns(count, 21, 2.2f)),
        by_distance(random_columns(count, 22, 1.0f)),
        by_normal(random_columns(count, 23, 1.0f)),
        by_rgb(random_columns(count, 24, 1.0f)),
        by_template(random_columns(count, 25, 1.0f)),
        normal(points),
        rgb(points),
        template_point(points),
        by_points(points),
        distance(count),
        engine(weights.shape(), isa) {
    engine.set_weights(weights);
    forward(true);
  }

  void forward(bool has_surface) {
    FieldValues values{distance.data(), {}, {}, as_planes(normal)};
    if (has_surface) values = {distance.data(), as_planes(rgb), as_planes(template_point), as_planes(normal)};
    engine.forward(as_points(points), workspace, values);
  }

  Columns points, by_distance, by_normal, by_rgb, by_template, normal, rgb, template_point, by_points;
  std::vector<float> distance;
  FieldEngine engine;
  FieldWorkspace workspace;
};

// On each instruction set.
void expect_normals(const FieldShape& shape, size_t count, bool has_surface) {
  const FieldWeights weights = random_weights(shape, 20);
  Normals at(weights, FieldIsa::kPortable, count);
  std::vector<double> distance;
  std::array<std::vector<double>, 3> normal;
  for (size_t i = 0; i < count; ++i) {
    const Result<double> expected = evaluate<double>(
        shape, as_lists(weights), {double(at.points[0][i]), double(at.points[1][i]), double(at.points[2][i])}, false);
    distance.push_back(expected.distance[0]);
    for (size_t c = 0; c < 3; ++c) normal[c].push_back(expected.distance[1 + c]);
  }
  FieldValueGradient given{at.by_distance[0].data(), {}, {}, as_const_planes(at.by_normal)};
  if (has_surface) {
    given.rgb = as_const_planes(at.by_rgb);
    given.template_point = as_const_planes(at.by_template);
  }
  const Gradients expected = gradients(weights, at.points, has_surface, [&](size_t i) {
    std::array<double, 10> seed{double(at.by_distance[0][i])};
    for (size_t c = 0; c < 3; ++c) {
      seed[1 + c] = double(at.by_normal[c][i]);
      seed[4 + c] = double(at.by_rgb[c][i]);
      seed[7 + c] = double(at.by_template[c][i]);
    }
    return seed;
  });

  for (const FieldIsa isa : supported_field_isas()) {
    SCOPED_TRACE(std::string(field_isa_name(isa)) + ", width " + std::to_string(shape.width) + ", points " +
                 std::to_string(count) + (has_surface ? ", surface" : ", geometry"));
    at.engine = FieldEngine(shape, isa);
    at.engine.set_weights(weights);
    at.forward(has_surface);
    EXPECT_LE(relative_error(at.distance, distance), 1e-5);
    for (size_t c = 0; c < 3; ++c) EXPECT_LE(relative_error(at.normal[c], normal[c]), 1e-4);
    FieldWeights gradient(shape);
    at.engine.backward(at.workspace, given, WeightGradient::kAll, &gradient, as_planes(at.by_points));
    expect_gradients(gradient, at.by_points, expected);
  }
}

TEST(FieldNormals, AreThoseOfFloat64AtEachWidthAndInstructionSet) {
  for (const int width : {48, 64, 96, 128}) {
    FieldShape shape;
    shape.width = width;
    for (const bool has_surface : {true, false}) expect_normals(shape, 6, has_surface);
  }
}

TEST(FieldNormals, TailsOf1To33PointsAreAsGood) {
  FieldShape shape;
  shape.width = 14;
  shape.geometry_layers = 3;
  for (size_t tail = 1; tail <= 33; ++tail) expect_normals(shape, tail, tail % 2 == 0);
  expect_normals(shape, 64 + 33, true);
}

TEST(FieldNormals, FiniteDifferencesOfTheEikonalTermAgree) {
  FieldShape shape;
  shape.width = 24;
  for (const FieldIsa isa : supported_field_isas()) {
    const FieldWeights weights = random_weights(shape, 24), direction = random_weights(shape, 25);
    Normals at(weights, isa, 20);
    const auto loss = [&](double step) {
      auto lists = as_lists(weights);
      const auto along = as_lists(direction);
      double sum = 0;
      for (size_t layer = 0; layer < lists.size(); ++layer) {
        for (size_t i = 0; i < lists[layer].size(); ++i) lists[layer][i] += step * along[layer][i];
      }
      for (size_t i = 0; i < at.distance.size(); ++i) {
        const auto jet =
            evaluate<double>(shape, lists, {double(at.points[0][i]), double(at.points[1][i]), double(at.points[2][i])},
                             false)
                .distance;
        const double norm = std::sqrt(jet[1] * jet[1] + jet[2] * jet[2] + jet[3] * jet[3]);
        sum += (norm - 1) * (norm - 1);
      }
      return sum;
    };
    Columns by_normal = at.normal;
    EXPECT_NEAR(eikonal_loss(20, as_const_planes(at.normal), 1.0f, as_planes(by_normal)), loss(0), 1e-4 * loss(0));
    FieldWeights gradient(shape);
    at.engine.backward(at.workspace, {nullptr, {}, {}, as_const_planes(by_normal)}, WeightGradient::kAll, &gradient);
    double product = 0;
    for (size_t i = 0; i < gradient.values().size(); ++i) {
      product += double(gradient.values()[i]) * double(direction.values()[i]);
    }
    // Squareplus bends within 0.014, which is why the step is so small.
    const double difference = (loss(1e-7) - loss(-1e-7)) / 2e-7;
    EXPECT_NEAR(product, difference, 1e-3 * std::abs(difference)) << field_isa_name(isa);
  }
}

TEST(FieldNormals, GradientsAreAddedInOneOrderAndToPersonalLayersWhereOnlyTheyAreAsked) {
  FieldShape shape;
  const FieldWeights weights = random_weights(shape, 26);
  for (const FieldIsa isa : supported_field_isas()) {
    Normals at(weights, isa, 77);
    FieldWeights first(shape), second(shape), personal(shape);
    for (FieldWeights* to : {&first, &second}) {
      at.engine.backward(at.workspace, {nullptr, {}, {}, as_const_planes(at.by_normal)}, WeightGradient::kAll, to);
    }
    EXPECT_EQ(std::memcmp(first.values().data(), second.values().data(), first.values().size() * 4), 0);
    at.engine.backward(at.workspace, {nullptr, {}, {}, as_const_planes(at.by_normal)}, WeightGradient::kPersonal,
                       &personal);
    for (int index = 0; index < shape.layers(); ++index) {
      auto expected = as_lists(first)[size_t(index)];
      if (!shape.is_personal(index)) std::fill(expected.begin(), expected.end(), 0.0);
      EXPECT_EQ(as_lists(personal)[size_t(index)], expected) << index;
    }
  }
}

TEST(FieldNormals, TheEikonalTermIsFiniteForSlopesOf0AndTinyAndHuge) {
  const Columns slopes{{{0.0f, 1e-20f, 1e10f, 1.0f, 1e-42f, 3e38f}, {0, 0, 0, 0, 0, 3e38f}, {0, 0, 0, 0, 0, 3e38f}}};
  Columns gradient = slopes;
  EXPECT_TRUE(std::isfinite(eikonal_loss(6, as_const_planes(slopes), 0.5f, as_planes(gradient))));
  for (const std::vector<float>& axis : gradient) {
    for (const float value : axis) EXPECT_TRUE(std::isfinite(value));
  }
  EXPECT_EQ(gradient[0][0], 0.0f);
  EXPECT_FLOAT_EQ(gradient[0][1], -1.0f);
  EXPECT_FLOAT_EQ(gradient[0][2], 1e10f);
  EXPECT_EQ(gradient[0][3], 0.0f);
  EXPECT_FLOAT_EQ(gradient[0][4], -1.0f);
}

TEST(FieldNormals, APointThatIsNotFiniteIsNanAndTheOthersStay) {
  FieldShape shape;
  const FieldWeights weights = random_weights(shape, 27);
  for (const FieldIsa isa : supported_field_isas()) {
    Normals good(weights, isa, 20), at(weights, isa, 20);
    at.points[1][3] = NAN;
    at.points[2][17] = INFINITY;
    at.forward(true);
    for (size_t i = 0; i < 20; ++i) {
      if (i == 3 || i == 17) {
        EXPECT_TRUE(std::isnan(at.distance[i]) && std::isnan(at.normal[0][i]));
      } else {
        EXPECT_EQ(at.distance[i], good.distance[i]);
        EXPECT_EQ(at.normal[0][i], good.normal[0][i]);
      }
    }
  }
}

}  // namespace
}  // namespace field_normals
