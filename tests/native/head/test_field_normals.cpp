// The normals of the engine, the gradients of the distance by the points, against float64.
#include <gtest/gtest.h>

#include <cmath>

#include "head/field/field_engine.h"
#include "head/reference_field.h"

namespace field_normals {
namespace {

using namespace maq::head;        // NOLINT
using namespace reference_field;  // NOLINT

void expect_normals(const FieldShape& shape, size_t count) {
  const FieldWeights weights = random_weights(shape, 20);
  const Columns points = random_columns(count, 21, 2.2f);
  std::vector<double> distance;
  std::array<std::vector<double>, 3> normal;
  for (size_t i = 0; i < count; ++i) {
    const Result<double> expected = evaluate<double>(
        shape, as_lists(weights), {double(points[0][i]), double(points[1][i]), double(points[2][i])}, false);
    distance.push_back(expected.distance[0]);
    for (size_t c = 0; c < 3; ++c) normal[c].push_back(expected.distance[1 + c]);
  }
  for (const FieldIsa isa : supported_field_isas()) {
    FieldEngine engine(shape, isa);
    engine.set_weights(weights);
    FieldWorkspace workspace;
    Columns found = points, rgb = points;
    std::vector<float> found_distance(count);
    for (const bool has_surface : {true, false}) {
      SCOPED_TRACE(std::string(field_isa_name(isa)) + ", width " + std::to_string(shape.width) + ", points " +
                   std::to_string(count));
      const Planes colours = has_surface ? as_planes(rgb) : Planes{};
      engine.forward(as_points(points), workspace, {found_distance.data(), colours, {}, as_planes(found)});
      EXPECT_LE(relative_error(found_distance, distance), 1e-5);
      for (size_t c = 0; c < 3; ++c) EXPECT_LE(relative_error(found[c], normal[c]), 1e-4);
    }
  }
}

TEST(FieldNormals, AreThoseOfFloat64AtEachWidthAndInstructionSet) {
  for (const int width : {14, 48, 64, 96, 128}) {
    FieldShape shape;
    shape.width = width;
    for (const size_t count : {1u, 6u, 33u, 97u}) expect_normals(shape, count);
  }
}

TEST(FieldNormals, APointThatIsNotFiniteIsNanAndTheOthersStay) {
  const FieldShape shape;
  const Columns points = random_columns(20, 21, 2.2f);
  for (const FieldIsa isa : supported_field_isas()) {
    FieldEngine engine(shape, isa);
    engine.set_weights(random_weights(shape, 27));
    FieldWorkspace workspace;
    Columns changed = points, good = points, found = points;
    changed[1][3] = NAN;
    changed[2][17] = INFINITY;
    engine.forward(as_points(points), workspace, {nullptr, {}, {}, as_planes(good)});
    engine.forward(as_points(changed), workspace, {nullptr, {}, {}, as_planes(found)});
    for (size_t i = 0; i < 20; ++i) {
      if (i == 3 || i == 17) {
        EXPECT_TRUE(std::isnan(found[0][i]));
      } else {
        EXPECT_EQ(found[0][i], good[0][i]);
      }
    }
  }
}

}  // namespace
}  // namespace field_normals
