// Conditions that a prior of heads must meet before it is used.
#include <gtest/gtest.h>

#include <cmath>

#include "head/head_prior.h"
#include "support/expect_error.h"

namespace head_prior {
namespace {

using namespace maq::head;  // NOLINT

HeadPrior small_prior() {
  FieldShape shape;
  shape.width = shape.surface_width = 16;
  HeadPrior prior(WeightBases(shape, 3, 2));
  for (int i = 0; i < 5; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      prior.anchors.template_points.push_back(float(i + axis) / 4);
      prior.anchors.mean.push_back(float(i - axis) / 4);
      for (int code = 0; code < 3; ++code) prior.anchors.linear.push_back(0.1f);
    }
    prior.anchors.sigma.push_back(0.02f);
  }
  prior.landmarks = {{"nose_tip", {0, -1, 0}}, {"chin", {0, -0.9f, -1}}};
  return prior;
}

TEST(HeadPrior, AWholeOneIsAcceptedAndItsPlacesAreFound) {
  const HeadPrior prior = small_prior();
  check_head_prior(prior);
  EXPECT_EQ(prior.cut.distance({5, 5, -2}), 0.5);
}

TEST(HeadPrior, EachThingThatIsWrongIsNamed) {
  const auto refuse = [](const char* text, auto&& change) {
    HeadPrior prior = small_prior();
    change(prior);
    expect_error(MAQ_ERROR_BAD_BUNDLE, text, [&] { check_head_prior(prior); });
  };
  for (const float sharpness : {0.0f, -1.0f, NAN, INFINITY}) {
    refuse("sharpness", [&](HeadPrior& p) { p.sharpness = sharpness; });
  }
  refuse("weights", [](HeadPrior& p) { p.bases.constant().layer(5).row(0)[0] = NAN; });
  refuse("weights", [](HeadPrior& p) { p.bases.basis_layer(1, 2).row(0)[0] = INFINITY; });
  refuse("weights", [](HeadPrior& p) { p.bases.basis_layer(5, 1).bias[3] = NAN; });
  refuse("cut", [](HeadPrior& p) { p.cut.normal = {0, 0, 2}; });
  refuse("cut", [](HeadPrior& p) { p.cut.point.x = NAN; });
  refuse("domain", [](HeadPrior& p) { p.bounds.min[1] = 0.1f; });
  refuse("domain", [](HeadPrior& p) { p.bounds.max[2] = 100; });
  refuse("anchors, but", [](HeadPrior& p) { p.anchors = {}; });
  refuse("one size", [](HeadPrior& p) { p.anchors.mean.pop_back(); });
  refuse("one size", [](HeadPrior& p) { p.anchors.linear.push_back(0); });
  refuse("finite, or farther", [](HeadPrior& p) { p.anchors.linear[7] = NAN; });
  refuse("finite, or farther", [](HeadPrior& p) { p.anchors.mean[1] = 1e9f; });
  refuse("standard deviation", [](HeadPrior& p) { p.anchors.sigma[0] = 0; });
  refuse("no name", [](HeadPrior& p) { p.landmarks[0].name.clear(); });
  refuse("no name", [](HeadPrior& p) { p.landmarks[0].name = std::string(kMaxLandmarkName + 1, 'a'); });
  refuse("\"chin\"", [](HeadPrior& p) { p.landmarks[0].name = "chin"; });
  refuse("\"nose_tip\"", [](HeadPrior& p) { p.landmarks[0].template_point[0] = NAN; });
  refuse("landmarks", [](HeadPrior& p) { p.landmarks.resize(kMaxNamedPoints + 1); });
}

}  // namespace
}  // namespace head_prior
