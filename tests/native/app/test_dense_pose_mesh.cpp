#include <maquette/densepose_mesh.hpp>

#include <gtest/gtest.h>

namespace {

constexpr int kNodes = 4;
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

// Each chart a square of the plane y = its part, x along U and z along V.
std::vector<float> squares() {
  std::vector<float> points;
  for (int part = 0; part < 24; ++part) {
    for (int u = 0; u < kNodes; ++u) {
      for (int v = 0; v < kNodes; ++v) points.insert(points.end(), {float(u), float(part), float(v)});
    }
  }
  return points;
}

float* node(std::vector<float>& points, int part, int u, int v) {
  return &points[size_t(((part * kNodes + u) * kNodes + v) * 3)];
}

TEST(DensePoseMesh, EveryCellOfAWholeChartIsTwoTriangles) {
  const maquette::DensePoseMesh mesh(squares(), kNodes);
  EXPECT_EQ(mesh.triangles.size(), size_t(24 * 3 * 3 * 2 * 3));
  double area = 0;
  for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const auto &a = mesh.triangles[i].point_m, &b = mesh.triangles[i + 1].point_m, &c = mesh.triangles[i + 2].point_m;
    area += std::abs((b[0] - a[0]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[0] - a[0])) / 2;
  }
  EXPECT_NEAR(area, 24 * 9, 1e-3) << "they cover the charts once";
}

TEST(DensePoseMesh, VerticesKnowTheirLabelAndNormal) {
  for (const maquette::DensePoseMesh::Vertex& vertex : maquette::DensePoseMesh(squares(), kNodes).triangles) {
    EXPECT_EQ(vertex.part, vertex.point_m[1]);
    EXPECT_FLOAT_EQ(vertex.u * (kNodes - 1), vertex.point_m[0]);
    EXPECT_FLOAT_EQ(vertex.v * (kNodes - 1), vertex.point_m[2]);
    EXPECT_EQ(vertex.normal[0], 0);
    EXPECT_NE(vertex.normal[1], 0);
    EXPECT_EQ(vertex.normal[2], 0);
  }
}

TEST(DensePoseMesh, AMissingCornerLeavesOneTriangleOfItsCell) {
  const size_t whole = maquette::DensePoseMesh(squares(), kNodes).triangles.size();
  for (const int u : {0, kNodes - 1}) {
    for (const int v : {0, kNodes - 1}) {
      std::vector<float> points = squares();
      std::fill_n(node(points, 5, u, v), 3, kUnknown);
      const maquette::DensePoseMesh mesh(points, kNodes);
      EXPECT_EQ(mesh.triangles.size(), whole - 3) << u << " " << v;
      for (const auto& vertex : mesh.triangles) {
        for (const float number : vertex.point_m) ASSERT_TRUE(std::isfinite(number));
        for (const float number : vertex.normal) ASSERT_TRUE(std::isfinite(number));
      }
    }
  }
}

TEST(DensePoseMesh, WhereAChartEndsItsNearestPointGoesOn) {
  std::vector<float> points = squares();
  std::fill_n(node(points, 2, 3, 1), 3, kUnknown);
  std::fill_n(node(points, 2, 2, 1), 3, kUnknown);
  const maquette::DensePoseMesh mesh(points, kNodes);
  const auto filled = [&](int part, int u, int v) {
    return &mesh.filled_points_m[size_t(((part * kNodes + v) * kNodes + u) * 3)];
  };
  EXPECT_EQ(filled(2, 2, 1)[0], 1) << "from U = 1, as near as V = 0 and 2, and first";
  EXPECT_EQ(filled(2, 3, 1)[0], 3) << "from V = 0 beside it";
  EXPECT_EQ(filled(2, 1, 3)[0], 1);
  EXPECT_EQ(filled(2, 1, 3)[2], 3) << "V outside, U inside";
  for (const float number : mesh.filled_points_m) ASSERT_TRUE(std::isfinite(number));
}

TEST(DensePoseMesh, AChartOfNothingHasNoTriangles) {
  std::vector<float> points = squares();
  for (int u = 0; u < kNodes; ++u) {
    for (int v = 0; v < kNodes; ++v) std::fill_n(node(points, 7, u, v), 3, kUnknown);
  }
  for (const auto& vertex : maquette::DensePoseMesh(points, kNodes).triangles) EXPECT_NE(vertex.part, 7);
}

TEST(DensePoseMesh, TheShippedBodyIsWholeAndStandsUpright) {
  const maquette::Context context;
  const maquette::DensePose densepose(context, MAQ_TEST_MODELS "/densepose-b-int8");
  const maq_densepose_surface surface = *densepose.surface();
  const size_t count = size_t(24 * surface.nodes * surface.nodes * 3);
  const maquette::DensePoseMesh mesh({surface.points_m, surface.points_m + count}, surface.nodes);
  float low = 10, high = -10;
  for (const auto& vertex : mesh.triangles) {
    low = std::min(low, vertex.point_m[2]);
    high = std::max(high, vertex.point_m[2]);
  }
  EXPECT_GT(mesh.triangles.size() / 3, size_t(10000));
  EXPECT_NEAR(high - low, 1.7, 0.25);
}

}  // namespace
