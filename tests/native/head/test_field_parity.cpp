// The field of prior files: the engine against what torch finds in float64 (make_tiny_head.py). Python tests compare
// the ONNX graph of the same files with the same numbers.
#include <gtest/gtest.h>

#include <cmath>

#include "head/field/field_engine.h"
#include "head/files/prior_file.h"
#include "head/reference_field.h"
#include "support/samples/tiny_head.h"

namespace field_parity {
namespace {

using namespace maq::head;        // NOLINT
using namespace reference_field;  // NOLINT

// Half of what the engine and ONNX Runtime may differ by; dm, and logits.
constexpr float kTolerance = 5e-6f;

// Rows of three, from `begin` on, as columns.
Columns columns_of(const std::vector<float>& rows, size_t begin, size_t count) {
  Columns columns;
  for (size_t c = 0; c < 3; ++c) {
    for (size_t i = 0; i < count; ++i) columns[c].push_back(rows.at(begin + 3 * i + c));
  }
  return columns;
}

TEST(FieldParity, ThePriorsOfFilesHaveTheFieldThatTorchFindsInThem) {
  for (const auto& [name, prior_file] :
       {std::pair("usual", "field/usual"), std::pair("float32", "priors/float32"), std::pair("int8", "priors/int8")}) {
    const HeadPrior prior = read_prior_file(tiny_head::kFolder + "/" + prior_file + ".maqp");
    const std::vector<float> rows = tiny_head::read_floats(std::string("field/") + name + ".f32");
    const size_t count = rows.size() / 10;
    ASSERT_EQ(count, 70u);
    const Columns points = columns_of(rows, 0, count), rgb = columns_of(rows, 4 * count, count),
                  template_point = columns_of(rows, 7 * count, count);
    for (const FieldIsa isa : supported_field_isas()) {
      SCOPED_TRACE(std::string(name) + ", " + field_isa_name(isa));
      FieldEngine engine(prior.bases.shape(), isa);
      engine.set_weights(prior.bases.combine(tiny_head::kCodes));
      FieldWorkspace workspace;
      std::vector<float> distance(count);
      Columns found_rgb = rgb, found_template = rgb;
      engine.forward(as_points(points), workspace, {distance.data(), as_planes(found_rgb), as_planes(found_template)});
      for (size_t i = 0; i < count; ++i) {
        EXPECT_NEAR(distance[i], rows[3 * count + i], kTolerance) << i;
        for (size_t c = 0; c < 3; ++c) {
          EXPECT_NEAR(found_rgb[c][i], rgb[c][i], kTolerance) << i;
          EXPECT_NEAR(found_template[c][i], template_point[c][i], kTolerance) << i;
        }
      }
    }
  }
}

}  // namespace
}  // namespace field_parity
