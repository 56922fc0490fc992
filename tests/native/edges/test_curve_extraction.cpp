// Curves of exact scenes: near perfect from the true field, close from a damaged one, none from nonsense.
#include <gtest/gtest.h>

#include "edges/curves/curve_extractor.h"
#include "support/expect_error.h"
#include "support/samples/analytic_scenes.h"

namespace {

using namespace maq::test;
using maq::CurveExtractor;
using maq::CurveType;
using maq::EdgeCurve;
using maq::EdgeCurves;
using maq::EdgeField;
using maq::Vec3;

struct NamedScene {
  const char* name;
  SolidScene (*make)();
};

constexpr NamedScene kScenes[] = {{"lone box", lone_box},
                                  {"carton on a table in a room", room},
                                  {"standing cylinder", standing_cylinder},
                                  {"stacked boxes", stacked_boxes},
                                  {"box with a rounded edge", rounded_box}};

SeenScene seen_at(SolidScene scene, bool is_large = false) {
  return see(std::move(scene), is_large ? camera_of(640, 480, 600) : camera_of(320, 240, 300));
}

double degrees(double rad) { return rad * 180 / kPi; }

// Distance of lines of at least 30 r from the straight edge of the scene that they lie along.
struct LineErrors {
  int lines = 0;
  double angle_deg = 0, offset_r = 0;  // the worst
};

LineErrors line_errors(const SeenScene& seen, const EdgeCurves& found) {
  LineErrors worst;
  for (const EdgeCurve& curve : found.curves) {
    const Vec3 a = found.points[size_t(curve.first_point)], b = found.points[size_t(curve.first_point) + 1];
    const double r = std::min(a.z, b.z) / seen.field.intrinsics.fx_px;
    if (curve.type != CurveType::kLine || curve.length_m < 30 * r) continue;
    double angle = INFINITY, offset = INFINITY;
    for (const SolidCurve& edge : seen.scene.curves) {
      if (edge.is_arc) continue;
      const Vec3 along = maq::normalized(edge.b - edge.a), middle = 0.5 * (a + b);
      const double off = maq::length(maq::cross(middle - edge.a, along)) / r;
      const double s = maq::dot(middle - edge.a, along) / maq::length(edge.b - edge.a);
      if (off > std::min(offset, 5.0) || s < -0.1 || s > 1.1) continue;
      offset = off;
      angle = degrees(std::asin(std::min(1.0, maq::length(maq::cross(maq::normalized(b - a), along)))));
    }
    if (offset > 5 || angle > 20) continue;  // counted by precision
    ++worst.lines;
    worst.angle_deg = std::max(worst.angle_deg, angle);
    worst.offset_r = std::max(worst.offset_r, offset);
  }
  return worst;
}

// Between the lines that meet in a corner, the farthest from a right angle.
double worst_right_angle_deg(const EdgeCurves& found, int& angles) {
  double worst = 0;
  angles = 0;
  for (size_t corner = 0; corner < found.corners.size(); ++corner) {
    std::vector<Vec3> directions;
    for (const EdgeCurve& curve : found.curves) {
      if (curve.type != CurveType::kLine) continue;
      for (const int end : curve.corner) {
        if (end != int(corner)) continue;
        const Vec3 d = found.points[size_t(curve.first_point) + 1] - found.points[size_t(curve.first_point)];
        directions.push_back(maq::normalized(d));
      }
    }
    for (size_t i = 0; i < directions.size(); ++i) {
      for (size_t j = 0; j < i; ++j) {
        const double cosine = std::abs(maq::dot(directions[i], directions[j]));
        if (cosine > 0.3) continue;  // of two bodies, or two parts of one edge
        worst = std::max(worst, degrees(std::asin(cosine)));
        ++angles;
      }
    }
  }
  return worst;
}

TEST(CurveExtraction, IsNearPerfectOnTrueFields) {
  CurveExtractor extractor;
  for (const NamedScene& scene : kScenes) {
    for (const bool is_large : {false, true}) {
      const SeenScene seen = seen_at(scene.make(), is_large);
      const EdgeCurves& found = extractor.extract(seen.field);
      const CurveScore result = score(seen, found);
      EXPECT_GE(result.f_score, 0.97) << scene.name << ", large " << is_large;
      EXPECT_GE(result.precision, 0.975) << scene.name << ", large " << is_large;
      EXPECT_GE(result.recall, 0.95) << scene.name << ", large " << is_large;
      EXPECT_GE(result.right_kind, 0.88) << scene.name << ", large " << is_large;
      EXPECT_LE(result.chamfer_r, 0.6) << scene.name << ", large " << is_large;
      const LineErrors lines = line_errors(seen, found);
      EXPECT_LE(lines.angle_deg, 1.5) << scene.name << ", large " << is_large;
      EXPECT_LE(lines.offset_r, 0.4) << scene.name << ", large " << is_large;
    }
  }
}

TEST(CurveExtraction, ABoxOfTheTrueFieldHasItsSizeAndRightAngles) {
  const SeenScene seen = seen_at(lone_box());
  CurveExtractor extractor;
  const EdgeCurves& found = extractor.extract(seen.field);
  const LineErrors lines = line_errors(seen, found);
  EXPECT_GE(lines.lines, 8);
  int angles = 0;
  EXPECT_LE(worst_right_angle_deg(found, angles), 0.3);
  EXPECT_GE(angles, 6);
  // Its sides are 500, 360 and 300 mm: each is the length of some crease within 1 mm.
  for (const double size : {0.5, 0.36, 0.3}) {
    double best = INFINITY;
    for (const EdgeCurve& curve : found.curves) best = std::min(best, std::abs(curve.length_m - size));
    EXPECT_LE(best, 1e-3) << size;
  }
}

TEST(CurveExtraction, SurvivesNoiseBlurAndSmearedDepth) {
  CurveExtractor extractor;
  struct Case {
    Damage damage;
    double f_score, angle_deg, offset_r;
  };
  const Case cases[] = {{{0.3, 0.3, false, 3, 0}, 0.95, 4.0, 1.3},
                        {{0.5, 0.3, false, 3, 0.1}, 0.95, 4.0, 1.3},
                        {{1.0, 1.0, false, 3, 0.3}, 0.88, 4.0, 1.3}};
  for (const NamedScene& scene : kScenes) {
    const SeenScene clean = seen_at(scene.make());
    for (const Case& each : cases) {
      SeenScene seen = clean;
      damage(seen, each.damage, 7);
      const EdgeCurves& found = extractor.extract(seen.field);
      const CurveScore result = score(seen, found);
      const LineErrors lines = line_errors(seen, found);
      EXPECT_GE(result.f_score, each.f_score) << scene.name << ", noise " << each.damage.noise_r;
      EXPECT_LE(lines.angle_deg, each.angle_deg) << scene.name << ", noise " << each.damage.noise_r;
      EXPECT_LE(lines.offset_r, each.offset_r) << scene.name << ", noise " << each.damage.noise_r;
    }
  }
}

// Depth near a crease is of neither side: what is taken from planes beside it does not move.
TEST(CurveExtraction, DepthOfACreaseIsNotThatOfItsSmearedPixels) {
  const SeenScene clean = seen_at(ridge(1.2));
  SeenScene smeared = clean;
  Damage by;
  by.flying_pixel_band_px = 3;
  damage(smeared, by, 1);
  CurveExtractor extractor;
  for (const SeenScene* seen : {&clean, const_cast<const SeenScene*>(&smeared)}) {
    const EdgeCurves& found = extractor.extract(seen->field);
    ASSERT_EQ(found.curves.size(), 1u);
    EXPECT_EQ(found.curves[0].convexity, maq::Convexity::kConvex);
    EXPECT_LE(line_errors(*seen, found).offset_r, 0.02);
  }
}

TEST(CurveExtraction, ConvexAndConcaveFollowFromThePlanes) {
  const SeenScene seen = seen_at(stacked_boxes());
  CurveExtractor extractor;
  const EdgeCurves& found = extractor.extract(seen.field);
  int convex = 0, concave = 0;
  for (const EdgeCurve& curve : found.curves) {
    EXPECT_TRUE(curve.kind == maq::kCreaseEdge || curve.convexity == maq::Convexity::kUnknown);
    convex += curve.convexity == maq::Convexity::kConvex;
    concave += curve.convexity == maq::Convexity::kConcave;
  }
  EXPECT_GE(convex, 6);   // three edges of either box that both sides are seen of
  EXPECT_GE(concave, 4);  // where they stand on what is below
}

TEST(CurveExtraction, ACylindersRimIsOneCircle) {
  const SeenScene seen = seen_at(standing_cylinder(), true);
  CurveExtractor extractor;
  const EdgeCurves& found = extractor.extract(seen.field);
  int creases = 0, boundaries = 0;
  for (const EdgeCurve& curve : found.curves) {
    if (curve.type != CurveType::kArc) continue;
    EXPECT_NEAR(maq::length(curve.x_axis), 0.25, 1e-3);
    (curve.kind == maq::kCreaseEdge ? creases : boundaries) += 1;
  }
  EXPECT_GE(creases, 2);     // the rim's near half, and where it stands
  EXPECT_GE(boundaries, 1);  // its far half
}

// Two planes that nearly are one say nothing about where they meet: the field has it, and nothing jumps.
TEST(CurveExtraction, PlanesUnderOneDegreeApartFallBackToTheField) {
  CurveExtractor extractor;
  double bend = 90;
  for (int step = 0; step < 17; ++step, bend *= 0.6) {  // down to 0.02 degrees
    SeenScene seen = seen_at(ridge(bend * kPi / 180));
    for (float& z : seen.field.depth_m) z = std::round(z * 10000) / 10000;  // steps of 0.1 mm
    const EdgeCurves& found = extractor.extract(seen.field);
    ASSERT_EQ(found.curves.size(), 1u) << bend;
    const LineErrors lines = line_errors(seen, found);
    ASSERT_EQ(lines.lines, 1) << bend;
    EXPECT_LE(lines.offset_r, 0.3) << bend;
    EXPECT_LE(lines.angle_deg, 0.2) << bend;
  }
}

TEST(CurveExtraction, IsFreeOfScale) {
  CurveExtractor extractor;
  const EdgeCurves one = extractor.extract(seen_at(stacked_boxes()).field);
  for (const double scale : {0.01, 100.0}) {
    SolidScene scene = stacked_boxes();
    scene.scale(scale);
    const EdgeCurves& found = extractor.extract(seen_at(scene).field);
    ASSERT_EQ(found.curves.size(), one.curves.size()) << scale;
    for (size_t i = 0; i < one.curves.size(); ++i) {
      EXPECT_NEAR(found.curves[i].length_m / scale, one.curves[i].length_m, 2e-3) << scale;
    }
  }
}

TEST(CurveExtraction, WorksAtAnyFocalLength) {
  CurveExtractor extractor;
  for (const double focal : {10.0, 60.0, 300.0, 10000.0}) {
    // The box as large in the image as it was: nearer by as much as the field of view is wider.
    SolidScene scene;
    scene.add_box({0, 0, 0}, {0.5, 0.36, 0.3}, 0.6, -1);
    const double away = std::max(0.45, 1.3 * focal / 300);
    scene.seen_from({0.077 * away, -0.846 * away, 0.14 + 0.47 * away}, {0, 0, 0.14});
    const SeenScene seen = see(scene, camera_of(320, 240, focal));
    const EdgeCurves& found = extractor.extract(seen.field);
    for (const EdgeCurve& curve : found.curves) EXPECT_TRUE(std::isfinite(curve.length_m));
    for (const Vec3& p : found.points) EXPECT_TRUE(maq::is_finite(p));
    // With 60 px the box is 60 px large, seen at steep angles; with 10 px it is 10 px large.
    EXPECT_GE(score(seen, found).f_score, focal >= 300 ? 0.97 : focal >= 60 ? 0.75 : 0.0) << focal;
  }
}

EdgeField plain_field(int width, int height, float distance) {
  EdgeField field;
  field.width = width, field.height = height;
  field.eps_r = 16;
  field.intrinsics = camera_of(width, height, 300);
  const size_t pixels = size_t(width) * size_t(height);
  field.distance_r.assign(pixels, distance);
  field.expected_error_r.assign(pixels, 0);
  field.kind.assign(pixels, maq::kCreaseEdge);
  field.depth_m.assign(pixels, 1);
  return field;
}

TEST(CurveExtraction, FieldsOfNonsenseHaveNoCurves) {
  CurveExtractor extractor;
  for (const auto& [width, height] : {std::pair{320, 240}, {17, 31}, {4000, 1}, {1, 1}, {2, 2}, {0, 0}}) {
    for (const float value : {0.0f, 16.0f, 3.0f, NAN, INFINITY, -1.0f, 1e30f}) {
      const EdgeCurves& found = extractor.extract(plain_field(width, height, value));
      EXPECT_TRUE(found.curves.empty()) << width << "x" << height << " of " << value;
      EXPECT_TRUE(found.corners.empty());
      const bool is_bad = !(value >= 0 && value <= 16);
      EXPECT_EQ(found.counts.bad_pixels, is_bad ? width * height : 0);
    }
  }
}

TEST(CurveExtraction, NoiseChequerboardsAndMissingDepthEnd) {
  CurveExtractor extractor;
  std::mt19937 bits(3);
  for (int kind = 0; kind < 5; ++kind) {
    EdgeField field = plain_field(320, 240, 16);
    for (size_t i = 0; i < field.distance_r.size(); ++i) {
      const size_t x = i % 320, y = i / 320;
      const float noise = float(bits() % 1000) / 1000;
      if (kind == 0) field.distance_r[i] = 16 * noise;
      if (kind == 1) field.distance_r[i] = (x + y) % 2 == 0 ? 0.0f : 16.0f;
      if (kind == 2) field.distance_r[i] = float(std::min(x % 10, 10 - x % 10));  // 32 edges side by side
      if (kind == 3) field.distance_r[i] = (bits() % 3 == 0) ? NAN : 3 * noise;
      if (kind == 4) field.distance_r[i] = float(std::min(x % 24, 24 - x % 24)), field.depth_m[i] = 0;
      if (kind == 3) field.depth_m[i] = bits() % 2 == 0 ? NAN : 1e-38f;
    }
    const EdgeCurves& found = extractor.extract(field);
    EXPECT_LE(found.curves.size(), 1024u);
    for (const Vec3& p : found.points) EXPECT_TRUE(maq::is_finite(p));
    EXPECT_GE(found.curves.size(), kind == 2 ? 25u : 0u);
    if (kind == 4) {
      EXPECT_TRUE(found.curves.empty());
      EXPECT_GE(found.counts.without_depth, 10);
    }
  }
}

// Where one surface ends before another that ends at the same pixels, there are two edges.
TEST(CurveExtraction, AnEdgeRightBehindAnotherIsFoundAsWell) {
  EdgeField field = plain_field(320, 240, 16);
  for (size_t i = 0; i < field.distance_r.size(); ++i) {
    const float off = float(i % 320) - 160.3f;
    field.distance_r[i] = std::min(16.0f, std::abs(off));
    field.depth_m[i] = off < 0 ? 1.0f : 1.5f;
    field.kind[i] = maq::kBoundaryEdge;
  }
  CurveExtractor extractor;
  const EdgeCurves& found = extractor.extract(field);
  ASSERT_EQ(found.curves.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(found.curves[i].kind, maq::kBoundaryEdge);
    EXPECT_NEAR(found.points[size_t(found.curves[i].first_point)].z, i == 0 ? 1 : 1.5, 1e-3);
  }
  // The farther surface goes on behind the nearer one: it has no edge there.
  for (size_t i = 0; i < field.distance_r.size(); ++i) {
    if (i % 320 > 160) field.distance_r[i] = 16;
  }
  EXPECT_EQ(extractor.extract(field).curves.size(), 1u);
}

// The ends of a bar pass from a surface to another far behind it: what lies between them is no line through the air.
TEST(CurveExtraction, ALineEndsWhereItsSurfaceDoes) {
  EdgeField field = plain_field(320, 240, 16);
  for (size_t i = 0; i < field.distance_r.size(); ++i) {
    const float off = float(i / 320) - 120.3f;
    field.distance_r[i] = off < 0 ? std::min(16.0f, -off) : 16.0f;
    field.depth_m[i] = off >= 0 ? 0.0f : i % 320 < 160 ? 1.0f : 3.0f;
    field.kind[i] = maq::kBoundaryEdge;
  }
  CurveExtractor extractor;
  const EdgeCurves& found = extractor.extract(field);
  ASSERT_EQ(found.curves.size(), 2u);
  for (const EdgeCurve& curve : found.curves) {
    const Vec3 a = found.points[size_t(curve.first_point)], b = found.points[size_t(curve.first_point) + 1];
    EXPECT_NEAR(a.z, b.z, 0.02);
  }
}

// Depth cameras have margins without depth, and shadows of near things on far ones: nothing ends there.
TEST(CurveExtraction, WhereKnownDepthMerelyEndsIsNoCurve) {
  const auto with = [](auto&& depth_of, auto&& distance_of) {
    EdgeField field = plain_field(320, 240, 16);
    for (size_t i = 0; i < field.distance_r.size(); ++i) {
      field.depth_m[i] = depth_of(int(i % 320), int(i / 320));
      field.distance_r[i] =
          field.depth_m[i] > 0 ? float(std::clamp(distance_of(int(i % 320), int(i / 320)), 0.0, 16.0)) : 16;
      field.kind[i] = maq::kBoundaryEdge;
    }
    CurveExtractor extractor;
    return extractor.extract(field);
  };
  const auto from_row = [](double row) { return [row](int, int y) { return std::abs(y - row + 0.5); }; };
  EXPECT_EQ(with([](int, int y) { return y < 12 ? 0.0f : 1.0f; }, from_row(12)).curves.size(), 0u) << "a margin";
  EXPECT_EQ(with([](int, int y) { return y < 60 ? 0.0f : 1.0f; }, from_row(60)).curves.size(), 1u) << "no background";
  const auto shadow = with([](int x, int) { return x < 150   ? 1.0f
                                                   : x < 162 ? 0.0f
                                                             : 1.5f; },
                           [](int x, int) { return std::min(std::abs(x - 149.5), std::abs(x - 161.5)); });
  ASSERT_EQ(shadow.curves.size(), 1u) << "of the near surface alone";
  EXPECT_NEAR(shadow.points[size_t(shadow.curves[0].first_point)].z, 1, 1e-3);
}

TEST(CurveExtraction, MoreCurvesThanTheLimitAreCounted) {
  EdgeField field = plain_field(320, 240, 16);
  for (size_t i = 0; i < field.distance_r.size(); ++i)
    field.distance_r[i] = float(std::min(i % 320 % 24, 24 - i % 320 % 24));
  maq::CurveOptions options;
  options.max_curves = 5;
  CurveExtractor extractor(options);
  const EdgeCurves& found = extractor.extract(field);
  EXPECT_LE(found.curves.size(), 5u);
  EXPECT_GE(found.counts.over_limit, 5);
}

TEST(CurveExtraction, TheSameFrameGivesTheSameCurvesWhateverWasBefore) {
  const SeenScene boxes = seen_at(stacked_boxes()), cylinder = seen_at(standing_cylinder());
  CurveExtractor fresh, used;
  used.extract(cylinder.field);
  used.extract(plain_field(17, 31, 0));
  const EdgeCurves& a = fresh.extract(boxes.field);
  const EdgeCurves& b = used.extract(boxes.field);
  ASSERT_EQ(a.points.size(), b.points.size());
  for (size_t i = 0; i < a.points.size(); ++i) EXPECT_EQ(maq::length(a.points[i] - b.points[i]), 0);
}

TEST(CurveExtraction, BadInputIsNamed) {
  CurveExtractor extractor;
  EdgeField field = plain_field(8, 8, 16);
  field.kind.pop_back();
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "63", [&] { extractor.extract(field); });
  field = plain_field(8, 8, 16);
  field.intrinsics.fx_px = 0;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "focal lengths", [&] { extractor.extract(field); });
  maq::CurveOptions options;
  options.min_length_px = NAN;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "min_length_px", [&] { CurveExtractor other(options); });
}

}  // namespace
