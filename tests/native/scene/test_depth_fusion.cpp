// Which points of depth maps are kept, against a rule written out in double, and what is chosen of many.
#include <gtest/gtest.h>

#include <set>

#include "scene/fusion/depth_fusion.h"
#include "support/samples/textured_scene.h"

namespace {

using maq::DepthMap;
using maq::FusedPixel;
using maq::FusionRule;
using textured_scene::camera_at;
using textured_scene::turned;

DepthMap map_of(const textured_scene::Surface& surface, const maq::PinholeCamera& camera) {
  const textured_scene::TracedView view = textured_scene::view_of(surface, camera);
  return {camera, {view.depth.begin(), view.depth.end()}, {}};
}

// Maps of a plane, each a neighbour of each; some depth is missing and some is wrong.
std::vector<DepthMap> noisy_maps(size_t count) {
  std::vector<DepthMap> maps;
  uint32_t random = 1;
  for (size_t i = 0; i < count; ++i) {
    const double across = double(i) - 0.5 * double(count);
    maps.push_back(map_of(textured_scene::plane({0.2, 0.1, 1}, 2),
                          turned(camera_at({0.1 * across, 0.02 * across, 0}, 64, 48), 0.04 * across)));
    for (float& depth : maps.back().depth) {
      random = random * 1664525u + 1013904223u;
      const uint32_t kind = random >> 24;
      depth *= kind < 40 ? 0.0f : kind < 80 ? 0.7f : kind < 120 ? 1.5f : 1.0f;
    }
    for (uint32_t k = 0; k < count; ++k) {
      if (k != i) maps[i].neighbours.push_back(k);
    }
  }
  return maps;
}

std::vector<FusedPixel> fuse(const std::vector<DepthMap>& maps, const FusionRule& rule, uint64_t max_points = 0,
                             int threads = 2) {
  maq::WorkerThreads workers(threads);
  return fuse_depth_maps(maps, rule, max_points, workers);
}

std::set<std::pair<uint32_t, uint32_t>> set_of(const std::vector<FusedPixel>& pixels) {
  std::set<std::pair<uint32_t, uint32_t>> set;
  for (const FusedPixel& at : pixels) set.insert({at.map, at.pixel});
  return set;
}

// A point in another map, in double: its depth there, and the pixel, -1 outside. Not clear at the edge of a pixel.
struct SeenPoint {
  double depth = 0;
  int pixel = -1;
  bool is_clear = true;
};

SeenPoint seen_in(const DepthMap& map, size_t pixel, const DepthMap& other) {
  const auto& a = map.camera;
  const auto& b = other.camera;
  const double z = double(map.depth[pixel]);
  const size_t width = size_t(a.width_px);
  const textured_scene::Vector at = {(double(pixel % width) - a.cx_px) / a.fx_px * z,
                                     (double(pixel / width) - a.cy_px) / a.fy_px * z, z};
  textured_scene::Vector world = a.centre, seen = {0, 0, 0};
  for (size_t k = 0; k < 3; ++k) {
    for (size_t row = 0; row < 3; ++row) world[k] += a.rotation[3 * row + k] * at[row];
  }
  for (size_t row = 0; row < 3; ++row) {
    for (size_t k = 0; k < 3; ++k) seen[row] += b.rotation[3 * row + k] * (world[k] - b.centre[k]);
  }
  const double u = seen[0] / seen[2] * b.fx_px + b.cx_px + 0.5, v = seen[1] / seen[2] * b.fy_px + b.cy_px + 0.5;
  const auto is_edge = [](double value) { return std::abs(value - std::round(value)) < 1e-3; };
  SeenPoint point{seen[2], -1, !is_edge(u) && !is_edge(v)};
  if (u >= 0 && v >= 0 && u < b.width_px && v < b.height_px) point.pixel = int(v) * b.width_px + int(u);
  return point;
}

TEST(DepthFusion, AgreesWithTheRuleInDouble) {
  const std::vector<DepthMap> maps = noisy_maps(6);
  const auto kept = set_of(fuse(maps, {}));
  size_t compared = 0, different = 0;
  for (size_t m = 0; m < maps.size(); ++m) {
    for (size_t i = 0; i < maps[m].depth.size(); ++i) {
      int agreeing = 1, behind = 0;
      bool is_clear = true;
      for (const uint32_t k : maps[m].neighbours) {
        if (maps[m].depth[i] == 0) break;
        const SeenPoint seen = seen_in(maps[m], i, maps[k]);
        is_clear = is_clear && seen.is_clear;
        const double found = seen.pixel < 0 ? 0 : double(maps[k].depth[size_t(seen.pixel)]);
        if (found > 1.03 * seen.depth) ++behind;
        if (found > 0 && std::abs(found - seen.depth) < 0.01 * seen.depth) ++agreeing;
      }
      if (!is_clear) continue;
      ++compared;
      const bool is_kept = maps[m].depth[i] > 0 && agreeing >= 2 * behind;
      if (is_kept != (kept.count({uint32_t(m), uint32_t(i)}) == 1)) ++different;
    }
  }
  EXPECT_GT(compared, 15000u);
  EXPECT_LT(different, compared / 1000);  // single precision at the borders of the rule
}

TEST(DepthFusion, PointsBeforeASurfaceThatOthersConfirmAreRemovedAndPointsThatNobodySeesStay) {
  std::vector<DepthMap> maps = noisy_maps(0);
  for (const double x : {0.0, -0.1, 0.1, 0.2}) {
    maps.push_back(map_of(textured_scene::plane({0, 0, 1}, 2), camera_at({x, 0, 0}, 64, 48)));
  }
  for (uint32_t i = 0; i < 4; ++i) {
    for (uint32_t k = 0; k < 4; ++k) {
      if (i != k) maps[i].neighbours.push_back(k);
    }
  }
  const uint32_t middle = 24 * 64 + 32, left = 24 * 64;
  maps[0].depth[middle] = 1;  // floats before the plane
  const auto kept = set_of(fuse(maps, {}));
  EXPECT_EQ(kept.count({0, middle}), 0u);
  EXPECT_EQ(kept.size(), 4u * 64 * 48 - 1);
  DepthMap alone = maps[0];
  alone.neighbours.clear();
  EXPECT_EQ(fuse({alone}, {}).size(), 64u * 48);
  EXPECT_EQ(kept.count({0, left}), 1u);
}

TEST(DepthFusion, AChoiceOfPointsIsEvenOverPixelsAndTheSameForAnyNumberOfThreads) {
  const std::vector<DepthMap> maps = noisy_maps(4);
  const std::vector<FusedPixel> all = fuse(maps, {});
  const std::vector<FusedPixel> some = fuse(maps, {}, 2000, 1);
  ASSERT_EQ(some.size(), 2000u);
  for (const int threads : {2, 5}) {
    const auto again = fuse(maps, {}, 2000, threads);
    EXPECT_TRUE(std::equal(some.begin(), some.end(), again.begin(), again.end(),
                           [](const auto& a, const auto& b) { return a.map == b.map && a.pixel == b.pixel; }));
  }
  const auto everything = set_of(all);
  size_t of_map[4] = {0, 0, 0, 0}, all_of_map[4] = {0, 0, 0, 0};
  for (const FusedPixel& at : some) {
    EXPECT_EQ(everything.count({at.map, at.pixel}), 1u);
    ++of_map[at.map];
  }
  for (const FusedPixel& at : all) ++all_of_map[at.map];
  for (int m = 0; m < 4; ++m) {
    EXPECT_NEAR(double(of_map[m]), 2000.0 * double(all_of_map[m]) / double(all.size()), 120) << m;
  }
  EXPECT_EQ(fuse(maps, {}, all.size() + 1).size(), all.size());
}

TEST(DepthFusion, CancelledItHasNoPoints) {
  const std::vector<DepthMap> maps = noisy_maps(3);
  maq::WorkerThreads workers(1);
  int calls = 0;
  EXPECT_TRUE(fuse_depth_maps(maps, {}, 0, workers, [&](double) { return ++calls < 2; }).empty());
  EXPECT_EQ(calls, 2);
}

TEST(DepthFusion, PointsLieWhereTheirDepthIs) {
  const std::vector<DepthMap> maps = {
      map_of(textured_scene::plane({0.2, 0.1, 1}, 2), turned(camera_at({0.1, 0, 0}), 0.2))};
  std::vector<FusedPixel> pixels = fuse(maps, {});
  const maq::PointCloud cloud = points_of(maps, {5, 6, 7}, pixels);
  EXPECT_EQ(pixels.size(), cloud.count());
  ASSERT_GT(cloud.count(), 10000u);
  for (size_t i = 0; i < cloud.count(); ++i) {
    EXPECT_NEAR(0.2 * (double(cloud.x[i]) + 5) + 0.1 * (double(cloud.y[i]) + 6) + double(cloud.z[i]) + 7, 2, 1e-5);
  }
}

TEST(DepthFusion, NoMapsAndMapsWithoutDepthHaveNoPoints) {
  EXPECT_TRUE(fuse({}, {}).empty());
  DepthMap nothing;
  EXPECT_TRUE(fuse({nothing, nothing}, {}).empty());
}

}  // namespace
