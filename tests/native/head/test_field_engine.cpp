// The field engine against its formulas in float64: values and first derivatives, on each instruction set.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "head/field/field_engine.h"
#include "head/reference_field.h"
#include "support/expect_error.h"

namespace {

using namespace maq::head;        // NOLINT
using namespace reference_field;  // NOLINT

constexpr float kReach = 2.2f;

FieldShape shape_of_width(int width) {
  FieldShape shape;
  shape.width = shape.surface_width = width;
  return shape;
}

// All that forward() gives, and a gradient for all of it.
struct Batch {
  explicit Batch(size_t count, unsigned seed = 7)
      : points(random_columns(count, seed, kReach)),
        by_distance(random_columns(count, seed + 1, 1.0f)),
        by_rgb(random_columns(count, seed + 2, 1.0f)),
        by_template(random_columns(count, seed + 3, 1.0f)),
        distance(count),
        rgb(random_columns(count, 0, 0.0f)),
        template_point(rgb),
        by_points(rgb) {}

  FieldValues values() { return {distance.data(), as_planes(rgb), as_planes(template_point)}; }
  FieldValueGradient gradient() const {
    return {by_distance[0].data(), as_const_planes(by_rgb), as_const_planes(by_template)};
  }
  std::array<double, 10> seeds(size_t i) const {
    std::array<double, 10> seed{double(by_distance[0][i])};
    for (size_t c = 0; c < 3; ++c) {
      seed[4 + c] = double(by_rgb[c][i]);
      seed[7 + c] = double(by_template[c][i]);
    }
    return seed;
  }

  Columns points, by_distance, by_rgb, by_template;
  std::vector<float> distance;
  Columns rgb, template_point, by_points;
};

FieldEngine engine_of(const FieldWeights& weights, FieldIsa isa) {
  FieldEngine engine(weights.shape(), isa);
  engine.set_weights(weights);
  return engine;
}

void expect_values(const FieldWeights& weights, FieldIsa isa, size_t count) {
  SCOPED_TRACE(std::string(field_isa_name(isa)) + ", width " + std::to_string(weights.shape().width) + ", points " +
               std::to_string(count));
  const FieldEngine engine = engine_of(weights, isa);
  FieldWorkspace workspace;
  Batch batch(count);
  engine.forward(as_points(batch.points), workspace, batch.values());
  std::vector<float> distance(count), distance_beside_gradient(count), geometry_alone(count);
  Columns gradient = batch.rgb;
  engine.distances(as_points(batch.points), workspace, distance.data());
  engine.distances(as_points(batch.points), workspace, distance_beside_gradient.data(), as_planes(gradient));
  engine.forward(as_points(batch.points), workspace, {geometry_alone.data(), {}, {}});

  const auto lists = as_lists(weights);
  std::vector<double> expected;
  std::array<std::vector<double>, 3> slopes, rgb, template_point;
  for (size_t i = 0; i < count; ++i) {
    const Result<double> at = evaluate<double>(
        weights.shape(), lists, {double(batch.points[0][i]), double(batch.points[1][i]), double(batch.points[2][i])});
    expected.push_back(at.distance[0]);
    for (size_t c = 0; c < 3; ++c) {
      slopes[c].push_back(at.distance[1 + c]);
      rgb[c].push_back(at.surface[c]);
      template_point[c].push_back(at.surface[3 + c]);
    }
  }
  EXPECT_LE(relative_error(batch.distance, expected), 1e-5);
  EXPECT_LE(relative_error(distance, expected), 1e-5);
  EXPECT_LE(relative_error(distance_beside_gradient, expected), 1e-5);
  EXPECT_LE(relative_error(geometry_alone, expected), 1e-5);
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_LE(relative_error(gradient[c], slopes[c]), 1e-4);
    EXPECT_LE(relative_error(batch.rgb[c], rgb[c]), 1e-5);
    EXPECT_LE(relative_error(batch.template_point[c], template_point[c]), 1e-5);
  }
}

// On each instruction set.
void expect_gradients(const FieldWeights& weights, size_t count, bool has_surface) {
  Batch batch(count);
  FieldValueGradient given = batch.gradient();
  if (!has_surface) given = {given.distance, {}, {}};
  const Gradients expected = gradients(weights, batch.points, has_surface, [&](size_t i) { return batch.seeds(i); });
  for (const FieldIsa isa : supported_field_isas()) {
    SCOPED_TRACE(std::string(field_isa_name(isa)) + ", width " + std::to_string(weights.shape().width) + ", points " +
                 std::to_string(count) + (has_surface ? ", surface" : ", geometry"));
    const FieldEngine engine = engine_of(weights, isa);
    FieldWorkspace workspace;
    FieldWeights gradient(weights.shape());
    engine.forward(as_points(batch.points), workspace,
                   has_surface ? batch.values() : FieldValues{batch.distance.data(), {}, {}, {}});
    engine.backward(workspace, given, WeightGradient::kAll, &gradient, as_planes(batch.by_points));
    expect_gradients(gradient, batch.by_points, expected);
  }
}

TEST(FieldEngine, ValuesAreThoseOfFloat64AtEachWidthAndInstructionSet) {
  for (const FieldIsa isa : supported_field_isas()) {
    for (const int width : {48, 64, 96, 128}) expect_values(random_weights(shape_of_width(width), 1), isa, 150);
  }
}

TEST(FieldEngine, GradientsAreThoseOfFloat64AtEachWidthAndInstructionSet) {
  for (const int width : {48, 64, 96, 128}) {
    const FieldWeights weights = random_weights(shape_of_width(width), 2);
    expect_gradients(weights, 10, true);
    expect_gradients(weights, 10, false);
  }
}

TEST(FieldEngine, TailsOf1To33PointsAreAsGood) {
  const FieldWeights weights = random_weights(shape_of_width(16), 3);
  for (size_t tail = 1; tail <= 33; ++tail) {
    for (const FieldIsa isa : supported_field_isas()) {
      expect_values(weights, isa, tail);
      expect_values(weights, isa, 64 + tail);
    }
    expect_gradients(weights, tail, true);
  }
  expect_gradients(weights, 64 + 33, true);
}

TEST(FieldEngine, OddSizesOfEachPartAreAsGood) {
  FieldShape shape;
  shape.octaves = 4;
  shape.width = 37;
  shape.geometry_layers = 2;
  shape.feature = 12;
  shape.surface_width = 21;
  shape.surface_layers = 3;
  shape.smoothing = 1e-3f;
  shape.personal_geometry_layers = 2;
  FieldShape smallest;
  smallest.octaves = smallest.feature = smallest.personal_geometry_layers = smallest.personal_surface_layers = 0;
  smallest.width = smallest.surface_width = smallest.geometry_layers = smallest.surface_layers = 1;
  for (const FieldShape& one : {shape, smallest}) {
    const FieldWeights weights = random_weights(one, 4);
    for (const FieldIsa isa : supported_field_isas()) expect_values(weights, isa, 70);
    expect_gradients(weights, 70, true);
  }
}

TEST(FieldEngine, TheLastOctaveOfTheEncodingIsExactTo2Millionths) {
  FieldShape shape;
  for (const FieldIsa isa : supported_field_isas()) {
    const FieldKernels& kernels = field_kernels(isa);
    AlignedFloats points(3 * kFieldBlock), encoding(size_t(shape.encoding()) * kFieldBlock);
    double largest = 0;
    for (int step = 0; step < 2000; ++step) {
      for (size_t i = 0; i < points.size(); ++i)
        points[i] = -4.0f + 8.0f * float(step * 192 + int(i)) / (2000 * 192.0f);
      kernels.encode(points.data(), shape.octaves, encoding.data());
      for (int octave = 0; octave < shape.octaves; ++octave) {
        for (size_t d = 0; d < 3; ++d) {
          for (size_t column = 0; column < kFieldBlock; ++column) {
            const double angle = std::ldexp(double(points[d * kFieldBlock + column]), octave);
            const size_t at = (size_t(3 + 6 * octave) + d) * kFieldBlock + column;
            largest = std::max(largest, std::abs(double(encoding[at]) - std::sin(angle)));
            largest = std::max(largest, std::abs(double(encoding[at + 3 * kFieldBlock]) - std::cos(angle)));
          }
        }
      }
    }
    EXPECT_LE(largest, 2e-7) << field_isa_name(isa);  // 2e-6 is what is asked for
  }
}

TEST(FieldEngine, FiniteDifferencesOfALossAgree) {
  FieldShape shape = shape_of_width(24);
  for (const FieldIsa isa : supported_field_isas()) {
    const FieldWeights weights = random_weights(shape, 5);
    const FieldWeights direction = random_weights(shape, 6);
    Batch batch(20);
    FieldWorkspace workspace;
    const auto loss = [&](double step) {
      auto lists = as_lists(weights);
      const auto along = as_lists(direction);
      double sum = 0;
      for (size_t layer = 0; layer < lists.size(); ++layer) {
        for (size_t i = 0; i < lists[layer].size(); ++i) lists[layer][i] += step * along[layer][i];
      }
      for (size_t i = 0; i < batch.distance.size(); ++i) {
        std::array<double, 3> point{double(batch.points[0][i]), double(batch.points[1][i]), double(batch.points[2][i])};
        const Result<double> at = evaluate<double>(shape, lists, point);
        const std::array<double, 10> seed = batch.seeds(i);
        sum += seed[0] * at.distance[0];
        for (size_t c = 0; c < 6; ++c) sum += seed[4 + c] * at.surface[c];
      }
      return sum;
    };
    const FieldEngine engine = engine_of(weights, isa);
    FieldWeights gradient(shape);
    engine.forward(as_points(batch.points), workspace, batch.values());
    engine.backward(workspace, batch.gradient(), WeightGradient::kAll, &gradient);
    double product = 0;
    for (size_t i = 0; i < gradient.values().size(); ++i) {
      product += double(gradient.values()[i]) * double(direction.values()[i]);
    }
    const double difference = (loss(1e-6) - loss(-1e-6)) / 2e-6;
    EXPECT_NEAR(product, difference, 1e-4 * std::abs(difference)) << field_isa_name(isa);
  }
}

TEST(FieldEngine, OnlyThePersonalLayersGetGradientsWhereOnlyTheyAreAsked) {
  const FieldWeights weights = random_weights(shape_of_width(48), 8);
  const FieldEngine engine = engine_of(weights, fastest_field_isa());
  FieldWorkspace workspace;
  Batch batch(40);
  FieldWeights all(weights.shape());
  engine.forward(as_points(batch.points), workspace, batch.values());
  engine.backward(workspace, batch.gradient(), WeightGradient::kAll, &all);
  engine.backward(workspace, batch.gradient(), WeightGradient::kNone, nullptr, as_planes(batch.by_points));
  EXPECT_NE(batch.by_points[0][0], 0.0f);
  for (const auto& [which, count] : {std::pair(WeightGradient::kPersonal, 4),
                                     {WeightGradient::kPersonalGeometry, 3},
                                     {WeightGradient::kPersonalSurface, 1}}) {
    FieldWeights personal(weights.shape());
    engine.backward(workspace, batch.gradient(), which, &personal);
    int personal_layers = 0;
    for (int index = 0; index < weights.shape().layers(); ++index) {
      auto expected = as_lists(all)[size_t(index)];
      const bool is_surface = index >= weights.shape().first_surface_layer();
      const bool is_asked =
          which == WeightGradient::kPersonal || is_surface == (which == WeightGradient::kPersonalSurface);
      const bool is_expected = is_asked && weights.shape().is_personal(index);
      if (!is_expected) std::fill(expected.begin(), expected.end(), 0.0);
      EXPECT_EQ(as_lists(personal)[size_t(index)], expected) << index;
      personal_layers += is_expected;
    }
    EXPECT_EQ(personal_layers, count);
  }
}

TEST(FieldEngine, GradientsAreAddedInOneOrder) {
  const FieldWeights weights = random_weights(shape_of_width(48), 9);
  for (const FieldIsa isa : supported_field_isas()) {
    const FieldEngine engine = engine_of(weights, isa);
    Batch batch(333);
    FieldWeights first(weights.shape()), second(weights.shape());
    for (FieldWeights* gradient : {&first, &second}) {
      FieldWorkspace workspace;
      engine.forward(as_points(batch.points), workspace, batch.values());
      engine.backward(workspace, batch.gradient(), WeightGradient::kAll, gradient);
    }
    EXPECT_EQ(std::memcmp(first.values().data(), second.values().data(), first.values().size() * 4), 0);
    // And to what is there.
    FieldWorkspace workspace;
    engine.forward(as_points(batch.points), workspace, batch.values());
    engine.backward(workspace, batch.gradient(), WeightGradient::kAll, &second);
    FieldWeights doubled = first;
    doubled.add(first);
    EXPECT_LE(relative_error(second.values(), doubled.values()), 1e-5);
  }
}

TEST(FieldEngine, APointsValuesDependOnNoOtherAndNotOnTheBatch) {
  const FieldWeights weights = random_weights(shape_of_width(48), 10);
  for (const FieldIsa isa : supported_field_isas()) {
    const FieldEngine engine = engine_of(weights, isa);
    FieldWorkspace workspace;
    Batch batch(100), alone(1);
    engine.forward(as_points(batch.points), workspace, batch.values());
    for (size_t i : {size_t(0), size_t(63), size_t(64), size_t(99)}) {
      for (size_t d = 0; d < 3; ++d) alone.points[d][0] = batch.points[d][i];
      engine.forward(as_points(alone.points), workspace, alone.values());
      EXPECT_EQ(alone.distance[0], batch.distance[i]);
      EXPECT_EQ(alone.template_point[2][0], batch.template_point[2][i]);
    }
  }
}

TEST(FieldEngine, APointThatIsNotFiniteIsNanAndTheOthersStay) {
  const float bad[] = {std::numeric_limits<float>::quiet_NaN(), INFINITY, -INFINITY};
  for (const int octaves : {0, 6}) {
    for (const FieldIsa isa : supported_field_isas()) {
      FieldShape shape = shape_of_width(48);
      shape.octaves = octaves;
      const FieldWeights weights = random_weights(shape, 11);
      const FieldEngine engine = engine_of(weights, isa);
      FieldWorkspace workspace;
      Batch good(70), batch(70);
      for (size_t i = 0; i < 3; ++i) batch.points[i][20 * i + 5] = bad[i];
      Columns good_slopes = good.rgb, slopes = good.rgb;
      engine.forward(as_points(good.points), workspace, good.values());
      engine.distances(as_points(good.points), workspace, good.distance.data(), as_planes(good_slopes));
      engine.forward(as_points(batch.points), workspace, batch.values());
      engine.distances(as_points(batch.points), workspace, batch.distance.data(), as_planes(slopes));
      for (size_t i = 0; i < 70; ++i) {
        const bool is_bad = i == 5 || i == 25 || i == 45;
        for (const auto& [got, expected] : {std::pair(&batch.distance, &good.distance),
                                            {&batch.rgb[1], &good.rgb[1]},
                                            {&batch.template_point[2], &good.template_point[2]},
                                            {&slopes[0], &good_slopes[0]}}) {
          if (is_bad) {
            EXPECT_TRUE(std::isnan((*got)[i])) << i;
          } else {
            EXPECT_EQ((*got)[i], (*expected)[i]) << i;
          }
        }
      }
    }
  }
}

// Where a value or a gradient is not finite, the point is left out: the sums are those of the others.
TEST(FieldEngine, PointsThatAreNotFiniteHaveNoPartInGradients) {
  const float bad[] = {std::numeric_limits<float>::quiet_NaN(), INFINITY, -INFINITY};
  for (const FieldIsa isa : supported_field_isas()) {
    const FieldShape shape = shape_of_width(48);
    const FieldWeights weights = random_weights(shape, 21);
    const FieldEngine engine = engine_of(weights, isa);
    Columns by = random_columns(70, 22, 1.0f), by_rgb = random_columns(70, 23, 1.0f);
    const auto run = [&](Batch& batch, FieldWeights& sum, Columns& by_points) {
      FieldWorkspace workspace;
      engine.forward(as_points(batch.points), workspace, batch.values());
      size_t left_out = 0;
      for (int round = 0; round < 2; ++round) {  // the second sees what the first left
        left_out = engine.backward(workspace, {by[0].data(), as_const_planes(by_rgb), {}}, WeightGradient::kAll, &sum,
                                   as_planes(by_points));
      }
      return left_out;
    };
    // The same with these points' gradients of 0.
    const size_t points[] = {5, 25, 45, 64, 65, 66};
    Columns kept_by = by, kept_rgb = by_rgb;
    for (const size_t i : points) {
      by[0][i] = 0;
      for (size_t c = 0; c < 3; ++c) by_rgb[c][i] = 0;
    }
    Batch good(70);
    FieldWeights expected(shape), sum(shape);
    Columns expected_points = by, by_points = by;
    EXPECT_EQ(run(good, expected, expected_points), 0u);
    by = kept_by, by_rgb = kept_rgb;
    Batch batch(70);
    for (size_t k = 0; k < 3; ++k) batch.points[k][points[k]] = bad[k];
    by[0][points[3]] = bad[0];
    by_rgb[1][points[4]] = bad[1];
    by_rgb[2][points[5]] = bad[2];
    EXPECT_EQ(run(batch, sum, by_points), 6u);
    EXPECT_EQ(sum.values(), expected.values());
    EXPECT_EQ(by_points, expected_points);
    for (const size_t i : points) EXPECT_EQ(by_points[0][i], 0.0f);
  }
}

TEST(FieldEngine, PointsFarAwayStayFinite) {
  const FieldWeights weights = random_weights(shape_of_width(48), 12);
  for (const FieldIsa isa : supported_field_isas()) {
    const FieldEngine engine = engine_of(weights, isa);
    FieldWorkspace workspace;
    for (const float far : {100.0f, 1e4f, 1e8f, 1e15f}) {
      Batch batch(3);
      batch.points[0][1] = far;
      batch.points[2][2] = -far;
      engine.forward(as_points(batch.points), workspace, batch.values());
      for (const float distance : batch.distance) EXPECT_TRUE(std::isfinite(distance)) << far;
    }
  }
}

TEST(FieldEngine, NoPointsAreNoWork) {
  const FieldWeights weights = random_weights(shape_of_width(48), 13);
  for (const FieldIsa isa : supported_field_isas()) {
    const FieldEngine engine = engine_of(weights, isa);
    FieldWorkspace workspace;
    const FieldPoints none{nullptr, nullptr, nullptr, 0};
    Batch batch(0);
    FieldWeights gradient(weights.shape());
    engine.distances(none, workspace, nullptr);
    engine.distances(none, workspace, nullptr, {});
    engine.forward(none, workspace, batch.values());
    engine.backward(workspace, {}, WeightGradient::kAll, &gradient);
    EXPECT_EQ(*std::max_element(gradient.values().begin(), gradient.values().end()), 0.0f);
  }
}

TEST(FieldEngine, WhatWasNotKeptIsSaid) {
  const FieldWeights weights = random_weights(shape_of_width(48), 14);
  const FieldEngine engine = engine_of(weights, FieldIsa::kPortable);
  FieldWorkspace workspace;
  Batch batch(5);
  FieldWeights gradient(weights.shape()), other(shape_of_width(64));
  const auto backward = [&] { engine.backward(workspace, batch.gradient(), WeightGradient::kAll, &gradient); };
  expect_error(MAQ_ERROR_INTERNAL, "was kept", backward);
  engine.forward(as_points(batch.points), workspace, {batch.distance.data(), {}, {}});
  expect_error(MAQ_ERROR_INTERNAL, "not run forwards", backward);
  engine.forward(as_points(batch.points), workspace, batch.values());
  expect_error(MAQ_ERROR_INTERNAL, "another shape",
               [&] { engine.backward(workspace, batch.gradient(), WeightGradient::kAll, &other); });
  engine.distances(as_points(batch.points), workspace, batch.distance.data());
  expect_error(MAQ_ERROR_INTERNAL, "was kept", backward);
  FieldEngine small(shape_of_width(48), FieldIsa::kPortable);
  expect_error(MAQ_ERROR_INTERNAL, "two shapes", [&] { small.set_weights(other); });
}

}  // namespace
