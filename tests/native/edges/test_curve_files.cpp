// Files of curves: the bytes that other programs are shown to read (tests/python/edges/test_curve_files.py), and their
// faults named.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "edges/curves/spline_fit.h"
#include "edges/files/curve_files.h"
#include "edges/files/curve_json.h"
#include "support/expect_error.h"
#include "support/temp_folder.h"

namespace {

using maq::EdgeCurve;
using maq::EdgeCurves;
using maq::Vec3;

// A line, a quarter of a circle and a spline of round numbers.
EdgeCurves example() {
  EdgeCurves curves;
  curves.corners.push_back({{0.5, 0, 1}, 2});
  EdgeCurve line;
  line.convexity = maq::Convexity::kConvex;
  line.corner = {-1, 0};
  line.has_plane[0] = true;
  line.plane[0] = {{0, 0, -1}, -1};
  line.length_m = 0.5;
  line.point_count = 2;
  curves.points = {{0, 0, 1}, {0.5, 0, 1}};
  curves.curves.push_back(line);
  EdgeCurve arc;
  arc.kind = maq::kBoundaryEdge;
  arc.type = maq::CurveType::kArc;
  arc.corner = {0, -1};
  arc.centre = {0.25, 0, 1}, arc.x_axis = {0.25, 0, 0}, arc.y_axis = {0, 0.25, 0};
  arc.sweep_rad = 1.5;
  arc.length_m = 0.375;
  arc.first_point = 2, arc.point_count = 31;
  for (int i = 0; i <= 30; ++i) {
    const double a = arc.sweep_rad * i / 30;
    curves.points.push_back(arc.centre + std::cos(a) * arc.x_axis + std::sin(a) * arc.y_axis);
  }
  curves.curves.push_back(arc);
  EdgeCurve spline;
  spline.convexity = maq::Convexity::kConcave;
  spline.type = maq::CurveType::kSpline;
  spline.first_point = 33, spline.point_count = 9;
  spline.control_count = 6;
  curves.controls = {{0, 0, 2}, {0.1, 0.2, 2}, {0.3, -0.1, 2.125}, {0.5, 0, 2}, {0.7, 0.1, 1.875}, {0.75, 0.3, 2}};
  for (int i = 0; i <= 8; ++i) curves.points.push_back(maq::spline_point(curves.controls.data(), 6, i / 8.0));
  for (int i = 33; i < 41; ++i) spline.length_m += maq::length(curves.points[size_t(i) + 1] - curves.points[size_t(i)]);
  curves.curves.push_back(spline);
  EdgeCurve circle;
  circle.type = maq::CurveType::kArc;
  circle.is_closed = true;
  circle.centre = {0.5, 0.5, 1}, circle.x_axis = {0, 0.1, 0}, circle.y_axis = {0, 0, 0.1};
  circle.sweep_rad = 2 * 3.141592653589793;
  circle.length_m = 0.1 * circle.sweep_rad;
  circle.first_point = 42, circle.point_count = 101;
  for (int i = 0; i <= 100; ++i) {
    const double a = circle.sweep_rad * i / 100;
    curves.points.push_back(circle.centre + std::cos(a) * circle.x_axis + std::sin(a) * circle.y_axis);
  }
  curves.curves.push_back(circle);
  return curves;
}

TEST(CurveFiles, AreTheOnesThatOtherProgramsRead) {
  const std::string kept = std::string(MAQ_TEST_DATA) + "/curves/";
  const TempFolder folder;
  for (const char* name : {"example.obj", "example.ply", "example.dxf", "example.step", "example.json"}) {
    const std::string path = folder.file(name);
    maq::write_curve_file(example(), path);
    EXPECT_EQ(read_text(path), read_text(kept + name)) << name;
  }
}

TEST(CurveFiles, TheJsonHasEveryParameter) {
  const auto document = nlohmann::json::parse(maq::curves_as_json(example()));
  ASSERT_EQ(document["curves"].size(), 4u);
  const auto& line = document["curves"][0];
  EXPECT_EQ(line["kind"], "crease");
  EXPECT_EQ(line["bend"], "convex");
  EXPECT_EQ(line["corners"], nlohmann::json({-1, 0}));
  EXPECT_EQ(line["planes"][0]["offset_m"], -1);
  EXPECT_TRUE(line["planes"][1].is_null());
  const auto& arc = document["curves"][1];
  EXPECT_EQ(arc["type"], "arc");
  EXPECT_EQ(arc["kind"], "boundary");
  EXPECT_EQ(arc["sweep_rad"], 1.5);
  EXPECT_EQ(document["curves"][2]["controls"].size(), 6u);
  EXPECT_EQ(document["corners"][0]["curves"], 2);
}

TEST(CurveFiles, NoCurvesAreFilesAsWell) {
  const TempFolder folder;
  for (const char* name : {"none.obj", "none.ply", "none.dxf", "none.step", "none.json"}) {
    const std::string path = folder.file(name);
    maq::write_curve_file(EdgeCurves(), path);
    EXPECT_GT(std::filesystem::file_size(path), 0u);
  }
}

TEST(CurveFiles, AnotherEndingIsNamedAndNothingIsWritten) {
  const TempFolder folder;
  const std::string path = folder.file("curves.stl");
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, ".dxf", [&] { maq::write_curve_file(example(), path); });
  EXPECT_FALSE(std::filesystem::exists(path));
  expect_error(MAQ_ERROR_UNWRITABLE, "nowhere", [&] { maq::write_curve_file(example(), "/nowhere/curves.obj"); });
}

}  // namespace
