// Lines, arcs and B-splines through points: exact where points are, the simpler type or nothing where they say nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "edges/curves/arc_fit.h"
#include "edges/curves/corners.h"
#include "edges/curves/line_fit.h"
#include "edges/curves/spline_fit.h"

namespace {

using maq::ArcFitter;
using maq::fit_line;
using maq::FitPoint;
using maq::SplineFitter;
using maq::Vec3;

constexpr double kPi = 3.141592653589793;

class Dice {
 public:
  explicit Dice(unsigned seed) : bits_(seed) {}
  double uniform() { return (double(bits_()) + 0.5) / 4294967296.0; }
  double normal() { return std::sqrt(-2 * std::log(uniform())) * std::cos(2 * kPi * uniform()); }
  Vec3 direction() { return maq::normalized({normal(), normal(), normal()}); }
  std::mt19937& bits() { return bits_; }

 private:
  std::mt19937 bits_;
};

std::vector<FitPoint> circle_points(Vec3 centre, Vec3 normal, double radius, double sweep_rad, int count, double noise,
                                    Dice& dice) {
  const Vec3 x = maq::any_orthogonal(normal), y = maq::cross(normal, x);
  std::vector<FitPoint> points;
  for (int i = 0; i < count; ++i) {
    const double a = sweep_rad * i / (count - 1);
    const Vec3 p = centre + radius * (std::cos(a) * x + std::sin(a) * y) +
                   noise * Vec3{dice.normal(), dice.normal(), dice.normal()};
    points.push_back({p, 1, 1});
  }
  return points;
}

// The direction of least squares by a plain search: the mean of squared distances is smallest along it.
double mean_square(const std::vector<FitPoint>& points, Vec3 at, Vec3 direction) {
  double sum = 0;
  for (const FitPoint& p : points) sum += std::pow(maq::length(maq::cross(p.point - at, direction)), 2);
  return sum / double(points.size());
}

TEST(CurveFits, ALineOfTwoPointsIsTheirSegment) {
  const FitPoint points[2] = {{{1, 2, 3}, 1, 1}, {{2, 2, 5}, 1, 1}};
  const auto fit = fit_line(points, 2);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(maq::length(fit->from - points[0].point), 0, 1e-12);
  EXPECT_NEAR(maq::length(fit->to - points[1].point), 0, 1e-12);
  EXPECT_FALSE(fit_line(points, 1));
}

TEST(CurveFits, PointsAtOnePlaceAreNoCurve) {
  std::vector<FitPoint> points(12, FitPoint{{0.3, -0.2, 1.7}, 0.01, 1});
  EXPECT_FALSE(fit_line(points.data(), points.size()));
  EXPECT_FALSE(ArcFitter().fit(points.data(), points.size()));
  EXPECT_FALSE(SplineFitter().fit(points.data(), points.size(), false, 0.5));
}

TEST(CurveFits, PointsThatAreNotFiniteAreNoCurve) {
  Dice dice(1);
  auto points = circle_points({0, 0, 2}, {0, 0, 1}, 1, 2, 20, 0, dice);
  for (const double bad : {double(NAN), double(INFINITY)}) {
    points[7].point.y = bad;
    EXPECT_FALSE(fit_line(points.data(), points.size()));
    EXPECT_FALSE(ArcFitter().fit(points.data(), points.size()));
    EXPECT_FALSE(SplineFitter().fit(points.data(), points.size(), false, 0.5));
  }
}

TEST(CurveFits, TheDirectionOfALineIsThatOfLeastSquares) {
  Dice dice(2);
  for (int trial = 0; trial < 20; ++trial) {
    const Vec3 along = dice.direction(), at{dice.normal(), dice.normal(), 5 + dice.normal()};
    std::vector<FitPoint> points;
    for (int i = 0; i < 40; ++i) {
      points.push_back({at + 0.05 * i * along + 1e-4 * Vec3{dice.normal(), dice.normal(), dice.normal()}, 1e-3, 1});
    }
    const auto fit = fit_line(points.data(), points.size());
    ASSERT_TRUE(fit);
    const Vec3 found = maq::normalized(fit->to - fit->from);
    EXPECT_GT(maq::dot(found, along), 1 - 1e-7);
    // The robust weight may cost a little; no direction beside it is better by more.
    const double best = mean_square(points, fit->from, found);
    for (int k = 0; k < 20; ++k) {
      EXPECT_GE(mean_square(points, fit->from, maq::normalized(found + 3e-4 * dice.direction())), 0.98 * best);
    }
  }
}

TEST(CurveFits, OneStrayPointMovesALineLittle) {
  std::vector<FitPoint> points;
  for (int i = 0; i < 30; ++i) points.push_back({{0.01 * i, 0, 1}, 0.001, 1});
  points[11].point.y = 0.02;  // 20 units
  const auto fit = fit_line(points.data(), points.size());
  ASSERT_TRUE(fit);
  // Plain least squares would lie 0.67 units off at its middle.
  EXPECT_LT(std::abs((fit->from.y + fit->to.y) / 2) / 0.001, 0.35);
}

TEST(CurveFits, TheOrderOfPointsHasNoEffectOnLinesAndArcs) {
  Dice dice(3);
  auto points = circle_points({0.2, -0.1, 2}, dice.direction(), 0.3, 2.2, 50, 1e-4, dice);
  for (FitPoint& p : points) p.unit_m = 1e-3;
  ArcFitter fitter;
  const auto line = fit_line(points.data(), points.size());
  const auto arc = fitter.fit(points.data(), points.size());
  ASSERT_TRUE(line && arc);
  for (int trial = 0; trial < 10; ++trial) {
    std::shuffle(points.begin(), points.end(), dice.bits());
    const auto other_line = fit_line(points.data(), points.size());
    const auto other_arc = fitter.fit(points.data(), points.size());
    ASSERT_TRUE(other_line && other_arc);
    const double same = maq::length(other_line->from - line->from) + maq::length(other_line->to - line->to);
    const double turned = maq::length(other_line->from - line->to) + maq::length(other_line->to - line->from);
    EXPECT_LT(std::min(same, turned), 1e-9);
    EXPECT_LT(maq::length(other_arc->centre - arc->centre), 1e-9);
    EXPECT_LT(maq::length(other_arc->x_axis - arc->x_axis), 1e-8);
    EXPECT_NEAR(other_arc->sweep_rad, arc->sweep_rad, 1e-8);
  }
}

TEST(CurveFits, AnArcIsFoundFromAQuarterTurnToACircle) {
  Dice dice(4);
  for (const double sweep : {0.4, kPi / 2, kPi, 5.0, 2 * kPi * 59 / 60}) {
    for (const double size : {0.01, 1.0, 100.0}) {
      const Vec3 normal = dice.direction(), centre = size * Vec3{0.3, -0.4, 3};
      auto points = circle_points(centre, normal, 0.5 * size, sweep, 60, 0, dice);
      for (FitPoint& p : points) p.unit_m = 0.01 * size;
      const auto arc = ArcFitter().fit(points.data(), points.size());
      ASSERT_TRUE(arc) << sweep << " rad, size " << size;
      EXPECT_LT(maq::length(arc->centre - centre) / size, 1e-7);
      EXPECT_NEAR(maq::length(arc->x_axis) / size, 0.5, 1e-7);
      EXPECT_EQ(arc->is_closed, sweep > 6);
      EXPECT_NEAR(arc->sweep_rad, arc->is_closed ? 2 * kPi : sweep, 1e-6);
      EXPECT_NEAR(maq::dot(arc->x_axis, arc->y_axis) / size / size, 0, 1e-9);
    }
  }
}

// Distances to the circle's plane and in it, minimised over all six parameters by Gauss-Newton with numerical slopes in
// a dense system: what the fit in its two steps comes close to.
TEST(CurveFits, AnArcIsThatOfADenseLeastSquares) {
  Dice dice(5);
  auto points = circle_points({0.1, 0.2, 2}, {0, 0, 1}, 0.5, 1.5, 80, 2e-4, dice);
  for (FitPoint& p : points) p.unit_m = 1e-3;
  const auto arc = ArcFitter().fit(points.data(), points.size());
  ASSERT_TRUE(arc);
  double state[3] = {0.1, 0.2, 0.5};  // centre and radius in the plane z = 2, which noise tilts by less than 1e-3
  for (int round = 0; round < 20; ++round) {
    double a[3][4] = {};
    for (const FitPoint& p : points) {
      const double dx = p.point.x - state[0], dy = p.point.y - state[1], d = std::hypot(dx, dy);
      const double row[4] = {-dx / d, -dy / d, -1, -(d - state[2])};
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 4; ++j) a[i][j] += row[i] * row[j];
      }
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        if (j == i) continue;
        const double f = a[j][i] / a[i][i];
        for (int k = i; k < 4; ++k) a[j][k] -= f * a[i][k];
      }
    }
    for (int i = 0; i < 3; ++i) state[i] += a[i][3] / a[i][i];
  }
  EXPECT_NEAR(arc->centre.x, state[0], 2e-4);
  EXPECT_NEAR(arc->centre.y, state[1], 2e-4);
  EXPECT_NEAR(maq::length(arc->x_axis), state[2], 2e-4);
}

TEST(CurveFits, WhatALineSaysAsWellIsNoArc) {
  Dice dice(6);
  ArcFitter fitter;
  std::vector<FitPoint> straight;
  for (int i = 0; i < 30; ++i) straight.push_back({{0.01 * i, 0.02 * i, 1 + 0.005 * i}, 1e-3, 1});
  EXPECT_FALSE(fitter.fit(straight.data(), straight.size()));
  EXPECT_FALSE(fitter.fit(straight.data(), 3));
  for (FitPoint& p : straight) p.point = p.point + 3e-4 * Vec3{dice.normal(), dice.normal(), dice.normal()};
  EXPECT_FALSE(fitter.fit(straight.data(), straight.size())) << "a line with noise";
  for (const double radius : {1.0, 100.0, 1e6}) {  // units: an arc of 1 degree, of a radius of 1e6 r
    const double sweep = radius > 1e5 ? 100 / radius : kPi / 180;
    auto points = circle_points({0, 0, 3 * radius}, {0, 0, 1}, radius, sweep, 40, 0, dice);
    for (FitPoint& p : points) p.point = p.point + 0.02 * sweep * radius * Vec3{dice.normal(), dice.normal(), 0};
    const auto arc = fitter.fit(points.data(), points.size());
    EXPECT_FALSE(arc) << radius;
    EXPECT_TRUE(fit_line(points.data(), points.size()));
  }
}

TEST(CurveFits, ASplineFollowsASineAndItsReverseIsTheSame) {
  std::vector<FitPoint> points;
  for (int i = 0; i < 80; ++i) {
    const double u = i / 79.0;
    points.push_back({{u, 0.1 * std::sin(5 * u), 2 + 0.05 * std::cos(3 * u)}, 1e-3, 1});
  }
  SplineFitter fitter;
  const auto rms = fitter.fit(points.data(), points.size(), false, 0.5);
  ASSERT_TRUE(rms);
  EXPECT_LE(*rms, 0.5);
  const auto controls = fitter.controls();
  std::reverse(points.begin(), points.end());
  const auto turned = fitter.fit(points.data(), points.size(), false, 0.5);
  ASSERT_TRUE(turned);
  ASSERT_EQ(fitter.controls().size(), controls.size());
  for (int step = 0; step <= 20; ++step) {
    const double t = 0.05 * step;
    const Vec3 a = maq::spline_point(controls.data(), int(controls.size()), t);
    const Vec3 b = maq::spline_point(fitter.controls().data(), int(controls.size()), 1 - t);
    EXPECT_LT(maq::length(a - b), 1e-6);
    EXPECT_NEAR(a.y, 0.1 * std::sin(5 * a.x), 2e-3);
  }
}

// The controls by a dense system written out: the basis from its definition (Cox and de Boor, without care for speed).
double basis(int i, int degree, double u, const std::vector<double>& knots) {
  if (degree == 0) return u >= knots[size_t(i)] && u < knots[size_t(i) + 1] ? 1 : 0;
  double sum = 0;
  const double a = knots[size_t(i + degree)] - knots[size_t(i)],
               b = knots[size_t(i + degree) + 1] - knots[size_t(i) + 1];
  if (a > 0) sum += (u - knots[size_t(i)]) / a * basis(i, degree - 1, u, knots);
  if (b > 0) sum += (knots[size_t(i + degree) + 1] - u) / b * basis(i + 1, degree - 1, u, knots);
  return sum;
}

TEST(CurveFits, ASplinesPointsAreThoseOfItsDefinition) {
  Dice dice(7);
  for (const int count : {4, 5, 9, 16}) {
    std::vector<Vec3> controls;
    for (int i = 0; i < count; ++i) controls.push_back({dice.normal(), dice.normal(), dice.normal()});
    std::vector<double> knots(3, 0.0);
    for (int i = 0; i <= count - 3; ++i) knots.push_back(i);
    knots.insert(knots.end(), 3, count - 3);
    for (int step = 0; step < 27; ++step) {
      const double t = 0.0371 * step;
      Vec3 expected;
      for (int i = 0; i < count; ++i) expected = expected + basis(i, 3, t * (count - 3), knots) * controls[size_t(i)];
      EXPECT_LT(maq::length(maq::spline_point(controls.data(), count, t) - expected), 1e-12) << count << " at " << t;
    }
    EXPECT_LT(maq::length(maq::spline_point(controls.data(), count, 1) - controls.back()), 1e-12);
  }
}

TEST(CurveFits, ClosedCurvesAndAFigureEightAreSplinesThatEndWhereTheyStart) {
  for (const bool is_eight : {false, true}) {
    std::vector<FitPoint> points;
    for (int i = 0; i < 120; ++i) {
      const double a = 2 * kPi * i / 120;
      const Vec3 p = is_eight ? Vec3{std::sin(a), std::sin(2 * a) / 2, 5} : Vec3{std::cos(a), 0.6 * std::sin(a), 5};
      points.push_back({p, 0.02, 1});
    }
    const auto arc = ArcFitter().fit(points.data(), points.size());
    EXPECT_TRUE(!arc || arc->rms > 1);
    SplineFitter fitter;
    const auto rms = fitter.fit(points.data(), points.size(), true, 0.5);
    ASSERT_TRUE(rms);
    EXPECT_LT(*rms, 1.5);
    const auto& controls = fitter.controls();
    EXPECT_EQ(maq::length(controls.front() - controls.back()), 0);
    for (const Vec3& c : controls) EXPECT_TRUE(maq::is_finite(c));
  }
}

maq::CurveEnd end_at(Vec3 point, Vec3 outward) { return {0, 0, point, maq::normalized(outward), 0.003, 0.003, -1}; }

TEST(CurveFits, ACornerIsWhereItsCurvesMeet) {
  const Vec3 corner{0.1, 0.2, 1};
  std::vector<maq::CurveEnd> ends;
  for (const Vec3 d : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0.3, 0.1, 1}}) {
    ends.push_back(end_at(corner + 0.02 * maq::normalized(d), -d));
  }
  std::vector<maq::EdgeCorner> corners;
  maq::CornerFinder().find(ends, 12, corners);
  ASSERT_EQ(corners.size(), 1u);
  EXPECT_EQ(corners[0].curve_count, 3);
  EXPECT_LT(maq::length(corners[0].point - corner), 3e-4);
  for (const maq::CurveEnd& end : ends) EXPECT_EQ(end.corner, 0);
}

TEST(CurveFits, CurvesThatRunTheSameWayShareTheMiddleOfTheirEndsContinuously) {
  // Three planes that meet in one line have three edges along it: as their directions close up, the corner moves to the
  // middle of the ends instead of away.
  const Vec3 middle{0, 0, 1};
  Vec3 before = middle;
  double angle = 0.4;
  for (int step = 0; step < 55; ++step, angle *= 0.7) {  // down to 1e-9
    std::vector<maq::CurveEnd> ends;
    for (int i = 0; i < 3; ++i) {
      const double a = 2 * kPi * i / 3;
      const Vec3 aside{std::cos(a), std::sin(a), 0};
      ends.push_back(end_at(middle + 1e-4 * aside, Vec3{0, 0, 1} + angle * aside));
    }
    std::vector<maq::EdgeCorner> corners;
    maq::CornerFinder().find(ends, 12, corners);
    ASSERT_EQ(corners.size(), 1u) << angle;
    EXPECT_LT(maq::length(corners[0].point - middle), 0.01) << angle;
    EXPECT_LT(maq::length(corners[0].point - before), 0.003) << angle;
    before = corners[0].point;
  }
}

TEST(CurveFits, LinesThatPassEachOtherAreNoCorner) {
  std::vector<maq::CurveEnd> ends{end_at({0, 0, 1}, {1, 0, 0}), end_at({0.01, -0.01, 1.05}, {0, 1, 0})};
  std::vector<maq::EdgeCorner> corners;
  maq::CornerFinder().find(ends, 12, corners);
  EXPECT_TRUE(corners.empty());
  EXPECT_EQ(ends[0].corner, -1);
}

}  // namespace
