// stub:solids: its depth against the definitions of its solids, its truth against geometry worked out by hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "core/frame.h"
#include "sources/registry.h"
#include "sources/synthetic/solids_rays.h"
#include "sources/synthetic/solids_scene.h"
#include "sources/synthetic/solids_truth.h"
#include "support/expect_error.h"

namespace {

using maq::Solid;
using maq::SolidsScene;
using maq::Vector3;

constexpr maq::SolidsPicture kPicture{160, 120};

std::vector<float> solids_frame(const std::string& options, int index = 0) {
  const auto source = maq::open_source("stub:solids?size=160x120" + options);
  maq::Frame frame;
  for (int i = 0; i <= index; ++i) EXPECT_EQ(source->next(0, frame), maq::NextFrame::kFrame);
  EXPECT_EQ(frame.image.format, MAQ_PIXEL_DEPTH32F);
  std::vector<float> metres(frame.storage.size() / sizeof(float));
  std::memcpy(metres.data(), frame.storage.data(), frame.storage.size());
  return metres;
}

Vector3 ray_of(const maq::SolidsPicture& picture, double x, double y) {
  return {(x - picture.centre_x_px()) / picture.focal_px(), (y - picture.centre_y_px()) / picture.focal_px(), 1};
}

// The point of the world at that depth of a pixel.
Vector3 point_at(const maq::SolidsView& view, const Vector3& ray, double depth) {
  Vector3 point = view.centre;
  for (size_t axis = 0; axis < 3; ++axis) point = point + depth * ray[axis] * view.axes[axis];
  return point;
}

// How deep a point is inside a solid, in metres; negative: outside.
double depth_inside(const Solid& solid, const Vector3& point) {
  const Vector3 p = point - solid.centre;
  const Vector3 turned = {solid.cosine * p[0] + solid.sine * p[2], p[1], solid.cosine * p[2] - solid.sine * p[0]};
  const double across = solid.radius > 0
                            ? solid.radius - std::hypot(turned[0], turned[2])
                            : std::min(solid.half[0] - std::fabs(turned[0]), solid.half[2] - std::fabs(turned[2]));
  return std::min(across, solid.half[1] - std::fabs(turned[1]));
}

double deepest(const SolidsScene& scene, const Vector3& point) {
  double inside = -1e9;
  for (const Solid& solid : scene.solids) inside = std::max(inside, depth_inside(solid, point));
  return inside;
}

TEST(Solids, EveryPixelIsWhereItsRayMeetsASolidFirst) {
  for (const char* name : {"wall", "box", "shelf", "room"}) {
    for (const uint64_t seed : {1, 2, 3}) {
      const SolidsScene scene = maq::make_solids_scene(name, seed);
      const maq::SolidsView view = maq::solids_view(scene, 5.0 * double(seed));
      std::vector<float> metres(160 * 120);
      maq::SolidsRays(scene, view).draw(kPicture, metres.data());
      for (int i = 0; i < 160 * 120; i += 37) {
        const Vector3 ray = ray_of(kPicture, i % 160, i / 160);  // NOLINT(bugprone-integer-division)
        const double depth = metres[size_t(i)];
        ASSERT_GT(depth, 0.3) << name;
        ASSERT_NEAR(deepest(scene, point_at(view, ray, depth)), 0, 1e-5) << name << " on a surface, pixel " << i;
        for (double before = 0.01; before < depth - 0.02; before += 0.01) {
          ASSERT_LT(deepest(scene, point_at(view, ray, before)), 1e-3) << name << " in front of pixel " << i;
        }
      }
    }
  }
}

TEST(Solids, ABoxHasItsTwelveEdgesAndStandsOnFourOfThem) {
  for (const uint64_t seed : {1, 7, 99}) {
    const SolidsScene scene = maq::make_solids_scene("box", seed);
    ASSERT_EQ(scene.solids.size(), 2u);
    const Solid& box = scene.solids[1];
    ASSERT_TRUE(box.is_carton);
    std::map<double, int> lengths;
    int concave = 0;
    for (const maq::SolidsEdge& edge : maq::solids_edges(scene)) {
      const Vector3 way = edge.to - edge.from;
      const double length = std::sqrt(maq::dot(way, way));
      if (length > 0.99) continue;  // the floor's own
      ++lengths[std::round(length * 1e9) / 1e9];
      concave += edge.is_concave ? 1 : 0;
      if (edge.is_concave) {
        EXPECT_NEAR(edge.from[1], 0, 1e-12);
      }
      EXPECT_NEAR(maq::dot(edge.normals[0], edge.normals[1]), 0, 1e-12);
      const Vector3 outside = 0.5 * (edge.from + edge.to) + 0.01 * (edge.normals[0] + edge.normals[1]);
      EXPECT_LT(deepest(scene, outside), 0) << "normals lead into the open";
    }
    EXPECT_EQ(concave, 4);
    std::map<double, int> expected;
    for (const double half : box.half) expected[std::round(2 * half * 1e9) / 1e9] += 4;
    EXPECT_EQ(lengths, expected);
  }
}

// The camera of "box" looks down at an angle: of an upright box it sees the top and, most of the time, two sides.
TEST(Solids, NineEdgesOfABoxAreSeenAndTheirKindsAreRight) {
  const SolidsScene scene = maq::make_solids_scene("box", 7);
  int seen_at_an_angle = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const auto edges = maq::visible_solids_edges(scene, maq::solids_view(scene, 0.4 * frame), kPicture);
    if (edges.size() != 9) {
      ASSERT_EQ(edges.size(), 7u) << "the top and one side";
      continue;
    }
    ++seen_at_an_angle;
    const auto count = [&](auto is) { return std::count_if(edges.begin(), edges.end(), is); };
    EXPECT_EQ(count([](const auto& edge) { return edge.is_concave; }), 2) << "where it stands on the floor";
    EXPECT_EQ(count([](const auto& edge) { return edge.is_boundary; }), 4) << "two of the top, two upright";
    for (const maq::VisibleSolidsEdge& edge : edges) {
      EXPECT_FALSE(edge.is_boundary && edge.is_concave);
      EXPECT_GT(edge.from[2], 0.3);
    }
  }
  EXPECT_GT(seen_at_an_angle, 40);
}

// Along each visible edge: the depth beside it is that of the edge on one side at least; along boundaries the other
// side lies behind. Nothing is nearer than the edge.
TEST(Solids, VisibleEdgesLieOnTheDepthImage) {
  for (const char* name : {"box", "shelf", "room"}) {
    const SolidsScene scene = maq::make_solids_scene(name, 3);
    const maq::SolidsView view = maq::solids_view(scene, 2);
    const maq::SolidsRays rays(scene, view);
    const auto edges = maq::visible_solids_edges(scene, view, kPicture);
    ASSERT_GT(edges.size(), 5u);
    for (const maq::VisibleSolidsEdge& edge : edges) {
      const double across = edge.from[0] / edge.from[2] - edge.to[0] / edge.to[2];
      const double down = edge.from[1] / edge.from[2] - edge.to[1] / edge.to[2];
      if (std::hypot(across, down) < 1e-4) continue;  // its ends are where the next edge is
      for (const double at : {0.1, 0.3, 0.5, 0.77, 0.9}) {
        const Vector3 p = edge.from + at * (edge.to - edge.from);
        const double x = p[0] / p[2], y = p[1] / p[2];
        EXPECT_LE(std::fabs(x) * kPicture.focal_px(), 80.001);
        EXPECT_LE(std::fabs(y) * kPicture.focal_px(), 60.001);
        double nearest = 1e9, farthest = 0;
        for (const double i : {-1e-9, 0.0, 1e-9}) {
          for (const double j : {-1e-9, 0.0, 1e-9}) {
            const double depth = rays.depth(x + i, y + j);
            nearest = std::min(nearest, depth);
            farthest = std::max(farthest, depth);
          }
        }
        ASSERT_NEAR(nearest, p[2], 1e-5) << name;  // sides that are seen at 0.1 degrees, too
        if (!edge.is_boundary) {
          EXPECT_NEAR(farthest, p[2], 1e-5) << name << " a crease is seen from both sides";
        }
      }
    }
  }
}

// An edge that is behind the box must not count as visible, and half hidden ones end where the box begins.
TEST(Solids, HiddenPartsOfAnEdgeAreCutOffWhereTheyBegin) {
  SolidsScene scene;
  Solid wall, post;
  wall.centre = {0, 0, 3};
  wall.half = {0.5, 0.5, 0.5};
  post.centre = {0, 0, 1.5};
  post.half = {0.1, 5, 0.1};
  scene.solids = {wall, post};
  const maq::SolidsView straight{{Vector3{1, 0, 0}, Vector3{0, 1, 0}, Vector3{0, 0, 1}}, {}};
  std::vector<double> ends;
  for (const maq::VisibleSolidsEdge& edge : maq::visible_solids_edges(scene, straight, kPicture)) {
    const bool is_top = std::fabs(edge.from[1] + 0.5) < 1e-9 && std::fabs(edge.to[1] + 0.5) < 1e-9;
    if (!is_top || std::fabs(edge.from[2] - 2.5) > 1e-9) continue;
    EXPECT_TRUE(edge.is_boundary);
    ends.insert(ends.end(), {edge.from[0], edge.to[0]});
  }
  std::sort(ends.begin(), ends.end());
  ASSERT_EQ(ends.size(), 4u) << "two parts, left and right of the post";
  const double hidden_from = 0.1 / 1.4 * 2.5;  // behind the front of the post
  const double expected[] = {-0.5, -hidden_from, hidden_from, 0.5};
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(ends[i], expected[i], 1e-8);
}

TEST(Solids, ARoundedEdgeIsNoEdgeAndItsEndsAreArcs) {
  const SolidsScene scene = maq::make_solids_scene("room", 1);
  const auto edges = maq::solids_edges(scene);
  const auto rounded = std::find_if(scene.solids.begin(), scene.solids.end(),
                                    [](const Solid& solid) { return solid.radius > 0 && solid.radius < 0.05; });
  ASSERT_NE(rounded, scene.solids.end());
  double arcs = 0;
  for (const maq::SolidsEdge& edge : edges) {
    const Vector3 middle = 0.5 * (edge.from + edge.to) - rounded->centre, way = edge.to - edge.from;
    const double from_axis = std::hypot(middle[0], middle[2]);
    const bool is_upright = std::fabs(way[1]) > 1e-9;
    EXPECT_FALSE(is_upright && from_axis < rounded->radius + 1e-6 && std::fabs(middle[1]) < rounded->half[1])
        << "where flat sides go over into the round one";
    const bool is_on_rim = std::fabs(from_axis - rounded->radius) < 1e-4 && !is_upright &&
                           std::fabs(std::fabs(middle[1]) - rounded->half[1]) < 1e-9;
    if (is_on_rim) arcs += std::sqrt(maq::dot(way, way));
  }
  const double quarter = 0.25 * 2 * 3.14159265358979 * rounded->radius;
  EXPECT_NEAR(arcs, 2 * quarter, 1e-4 * quarter + 2e-6) << "above and below a quarter of a circle each";
}

TEST(Solids, AWallHasNoEdgeInView) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const SolidsScene scene = maq::make_solids_scene("wall", seed);
    for (int i = 0; i < 24; ++i) {
      EXPECT_TRUE(maq::visible_solids_edges(scene, maq::solids_view(scene, i), kPicture).empty()) << seed << ' ' << i;
    }
  }
}

TEST(Solids, FramesAreAFunctionOfTheUriAndTheirNumber) {
  for (const char* options : {"&scene=box", "&scene=shelf&noise=stereo&seed=7", "&scene=room&noise=tof&seed=7"}) {
    const std::vector<float> fourth = solids_frame(options, 3);
    EXPECT_EQ(fourth, solids_frame(options, 3)) << options;
    const auto source = maq::open_source("stub:solids?size=160x120" + std::string(options));
    source->seek(100000000);
    maq::Frame frame;
    ASSERT_EQ(source->next(0, frame), maq::NextFrame::kFrame);
    EXPECT_EQ(std::memcmp(frame.storage.data(), fourth.data(), frame.storage.size()), 0) << options;
    EXPECT_NE(fourth, solids_frame(options, 4)) << "it turns";
  }
  EXPECT_NE(solids_frame("&seed=1"), solids_frame("&seed=2"));
  EXPECT_NE(solids_frame("&noise=tof&scene=wall", 0), solids_frame("&noise=tof&scene=wall", 1));
}

// The numbers themselves: a change of them, or a processor with other rounding, is seen.
TEST(Solids, HaveTheSameBitsOnEveryProcessor) {
  const auto hash = [](const std::vector<float>& metres) {
    uint64_t value = 1469598103934665603u;  // FNV-1a
    for (size_t i = 0; i < metres.size() * sizeof(float); ++i) {
      value = (value ^ reinterpret_cast<const uint8_t*>(metres.data())[i]) * 1099511628211u;
    }
    return value;
  };
  EXPECT_EQ(hash(solids_frame("&scene=box&seed=7", 10)), 728746732071266879u);
  EXPECT_EQ(hash(solids_frame("&scene=room&noise=stereo&seed=7", 10)), 13809155310891668852u);
  EXPECT_EQ(hash(solids_frame("&scene=shelf&noise=tof&seed=7", 10)), 17276720831738072764u);
}

TEST(Solids, HaveTheCalibrationThatTheyAreDrawnWith) {
  const auto source = maq::open_source("stub:solids?size=160x120");
  const maq_intrinsics* found = source->intrinsics();
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->width_px, 160);
  EXPECT_EQ(found->height_px, 120);
  EXPECT_EQ(found->fx_px, kPicture.focal_px());
  EXPECT_EQ(found->fy_px, kPicture.focal_px());
  EXPECT_EQ(found->cx_px, 79.5);
  EXPECT_EQ(found->cy_px, 59.5);
  EXPECT_EQ(maq::open_source("stub:solids")->info().width_px, 320);
  EXPECT_EQ(maq::open_source("stub:pattern")->intrinsics(), nullptr);
  EXPECT_NE(maq::open_source("stub:solids?live=1")->intrinsics(), nullptr);
}

TEST(Solids, UnknownScenesAndNoisesAreNamed) {
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "scene=sphere is not known; there are wall, box",
               [] { maq::open_source("stub:solids?scene=sphere"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "noise=loud is not known; there are none, stereo",
               [] { maq::open_source("stub:solids?noise=loud"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "stub: has scene, noise, seed",
               [] { maq::open_source("stub:solids?count=3"); });
  for (const char* size : {"1x1", "1x300", "300x1", "17x31"}) {
    for (const char* noise : {"none", "stereo", "tof"}) {
      maq::Frame frame;
      const auto source = maq::open_source(std::string("stub:solids?scene=room&size=") + size + "&noise=" + noise);
      EXPECT_EQ(source->next(0, frame), maq::NextFrame::kFrame);
    }
  }
}

}  // namespace
