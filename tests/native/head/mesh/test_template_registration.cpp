// The template head laid onto surfaces that are known exactly, and onto fields that are wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "head/registration/template_registration.h"

namespace template_registration {
namespace {

using namespace maq::head;  // NOLINT

constexpr int kRings = 23, kAround = 40;
constexpr double kPi = 3.14159265358979323846;

using Point = std::array<double, 3>;

// A ball of radius 1 without its lowest part, a point behind its front, an octahedron that looks out of it as an eye
// does, and one inside; the action moves the ball's front down.
HeadTemplate ball() {
  HeadTemplate made;
  const auto add = [&](Point p, TemplateKind kind) {
    for (const double value : p) made.points.push_back(float(value));
    made.kinds.push_back(kind);
    made.vertex_points.push_back(uint32_t(made.vertex_points.size()));
    made.texture_coordinates.insert(made.texture_coordinates.end(), {0.5f, 0.5f});
    return uint32_t(made.kinds.size() - 1);
  };
  const auto triangle = [&](uint32_t a, uint32_t b, uint32_t c) {
    made.triangles.insert(made.triangles.end(), {a, b, c});
  };
  for (int ring = 0; ring < kRings; ++ring) {
    const double polar = 0.08 + 0.1 * ring;
    for (int step = 0; step < kAround; ++step) {
      const double angle = 2 * kPi * step / kAround;
      add({std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle), std::cos(polar)},
          TemplateKind::kSurface);
    }
  }
  for (int ring = 0; ring + 1 < kRings; ++ring) {
    for (int step = 0; step < kAround; ++step) {
      const uint32_t a = uint32_t(ring * kAround + step), b = uint32_t(ring * kAround + (step + 1) % kAround);
      triangle(a, a + kAround, b + kAround), triangle(a, b + kAround, b);
    }
  }
  const uint32_t inside = add({0, -0.8, 0}, TemplateKind::kInside);
  uint32_t front = 0;
  for (uint32_t i = 0; i < inside; ++i) {
    if (made.points[3 * i + 1] < made.points[3 * front + 1]) front = i;
  }
  triangle(inside, front, front + 1), triangle(inside, front + 1, front + kAround);
  const uint32_t faces[8][3] = {{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {4, 0, 2}, {1, 0, 5}, {3, 1, 5}, {4, 3, 5}, {0, 4, 5}};
  const auto octahedron = [&](Point middle, double radius, TemplateKind kind, TemplateKind of_front) {
    const uint32_t first = uint32_t(made.kinds.size());
    const double sides[6][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    for (int k = 0; k < 6; ++k) {
      add({middle[0] + radius * sides[k][0], middle[1] + radius * sides[k][1], middle[2] + radius * sides[k][2]},
          k == 4 ? of_front : kind);
    }
    for (const auto& face : faces) triangle(first + face[0], first + face[1], first + face[2]);
  };
  octahedron({0, -0.9, 0}, 0.1, TemplateKind::kEye, TemplateKind::kEyeFront);
  octahedron({0.2, -0.5, -0.3}, 0.05, TemplateKind::kTeeth, TemplateKind::kTeeth);
  FacialAction action;
  action.name = "jawOpen";
  for (uint32_t i = 0; i < inside; ++i) {
    if (made.points[3 * i + 1] > -0.3f) continue;
    action.points.push_back(i);
    action.deltas.insert(action.deltas.end(), {0, 0, -0.1f});
  }
  made.actions.push_back(action);
  return made;
}

// An ellipsoid, whose point r t is point t of the ball; `bend`, in template points, goes up and down along z.
struct Ellipsoid {
  Point radii;
  double bend = 0;

  void operator()(const float* x, const float* y, const float* z, float* values, size_t count) const {
    for (size_t i = 0; i < count; ++i) {
      const double p[3] = {double(x[i]), double(y[i]), double(z[i])};
      double norm = 0;
      for (size_t k = 0; k < 3; ++k) norm += p[k] * p[k] / (radii[k] * radii[k]);
      norm = std::sqrt(norm);
      values[i] = float(norm - 1);
      for (size_t k = 0; k < 3; ++k) {
        values[(1 + k) * count + i] = float(p[k] / (radii[k] * radii[k] * norm));
        values[(4 + k) * count + i] = float(p[k] / radii[k] + (k == 2 ? bend * std::sin(60 * p[2]) : 0));
        values[(7 + k) * count + i] = float(p[k]);
      }
    }
  }
};

double squared_norm(const Ellipsoid& field, const float* p) {
  double norm = 0;
  for (size_t k = 0; k < 3; ++k) norm += double(p[k] * p[k]) / (field.radii[k] * field.radii[k]);
  return norm;
}

void expect_finite(const TemplateRegistration& registration, const HeadTemplate& of) {
  ASSERT_EQ(registration.points.size(), of.points.size());
  ASSERT_EQ(registration.colours.size(), of.points.size());
  for (const float value : registration.points) ASSERT_LT(std::abs(value), 20);
  EXPECT_GT(registration.scale, 0.1);
  EXPECT_LT(registration.scale, 10);
}

TEST(TemplateRegistration, PutEachPointWhereTheFieldHasIt) {
  const HeadTemplate head = ball();
  ASSERT_EQ(template_fault(head), "");
  const Ellipsoid field{{0.85, 1.05, 1.2}};
  const TemplateRegistration registration = register_template(head, head.points, field);
  expect_finite(registration, head);
  for (size_t i = 0; i < size_t(kRings * kAround); ++i) {
    for (size_t k = 0; k < 3; ++k) {
      ASSERT_NEAR(double(registration.points[3 * i + k]), field.radii[k] * double(head.points[3 * i + k]), 2e-3) << i;
    }
  }
  EXPECT_LT(registration.mean_distance, 1e-4);
  EXPECT_LT(registration.max_distance, 1e-3);
  EXPECT_LT(registration.mean_residual, 1e-3);
  EXPECT_EQ(registration.flipped, 0u);
  EXPECT_NEAR(registration.scale, 1.05, 0.06) << "of the front, which is narrower and taller";
  EXPECT_FLOAT_EQ(registration.colours[0], registration.points[0]) << "the field's, at the point";
}

TEST(TemplateRegistration, LetSkinInsideFollowAndKeepTheFormOfPartsThatMoveAsAWhole) {
  const HeadTemplate head = ball();
  const TemplateRegistration registration = register_template(head, head.points, Ellipsoid{{1.2, 1.2, 1.2}});
  EXPECT_NEAR(registration.scale, 1.2, 1e-3);
  const size_t inside = size_t(kRings * kAround), eye = inside + 1, teeth = eye + 6;
  EXPECT_NEAR(registration.points[3 * inside + 1], -0.8 - 0.2, 0.01) << "as far as the front moved";
  const auto between = [](const std::vector<float>& points, size_t a, size_t b) {
    return std::hypot(points[3 * a] - points[3 * b], points[3 * a + 1] - points[3 * b + 1],
                      points[3 * a + 2] - points[3 * b + 2]);
  };
  for (const size_t first : {eye, teeth}) {
    for (size_t k = 1; k < 6; ++k) {
      const double scale = first == teeth ? 0.92 * 1.2 : 1.2;  // lips of fitted heads are flat
      EXPECT_NEAR(between(registration.points, first, first + k),
                  scale * double(between(head.points, first, first + k)), 1e-4);
    }
  }
  EXPECT_NEAR(registration.points[3 * (eye + 4) + 1], -1.2, 1e-2) << "the eye's front is on the surface";
  EXPECT_NEAR(registration.points[3 * teeth + 1], -0.6, 0.02) << "where a larger head has them";
}

TEST(TemplateRegistration, FlipNoTriangleWhereTemplatePointsGoUpAndDown) {
  const HeadTemplate head = ball();
  const Ellipsoid field{{0.9, 1.1, 1}, 0.08};
  const TemplateRegistration registration = register_template(head, head.points, field);
  expect_finite(registration, head);
  EXPECT_EQ(registration.flipped, 0u);
  EXPECT_LT(registration.mean_distance, 1e-3);
  EXPECT_GT(registration.mean_residual, 0.01) << "the field contradicts itself";
}

TEST(TemplateRegistration, LetTheNeighboursDecideWhereTheFieldIsNoNumber) {
  const HeadTemplate head = ball();
  const Ellipsoid field{{0.9, 1.1, 1}};
  const auto with_hole = [&](const float* x, const float* y, const float* z, float* values, size_t count) {
    field(x, y, z, values, count);
    for (size_t i = 0; i < count; ++i) {
      if (x[i] < 0.6f) continue;
      for (size_t plane = 0; plane < kRegistrationValues; ++plane) values[plane * count + i] = NAN;
    }
  };
  const TemplateRegistration registration = register_template(head, head.points, with_hole);
  expect_finite(registration, head);
  for (size_t i = 0; i < size_t(kRings * kAround); ++i) {
    const double norm = std::sqrt(squared_norm(field, &registration.points[3 * i]));
    ASSERT_NEAR(norm, 1, head.points[3 * i] < 0.6f ? 0.02 : 0.15) << i;
  }
}

TEST(TemplateRegistration, OfFieldsAndStartsThatAreNoNumbersAreFinite) {
  const HeadTemplate head = ball();
  const std::vector<float> nowhere(head.points.size(), NAN), far(head.points.size(), 1e30f);
  for (const float value : {0.0f, 1.0f, float(NAN), float(INFINITY), -1e30f}) {
    const auto field = [&](const float*, const float*, const float*, float* values, size_t count) {
      std::fill_n(values, kRegistrationValues * count, value);
    };
    for (const auto* starts : {&head.points, &nowhere, &far})
      expect_finite(register_template(head, *starts, field), head);
  }
}

}  // namespace
}  // namespace template_registration
