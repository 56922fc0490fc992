// Scenes in blocks drawn by several workers, against the whole cloud and against a projection in long double.
#include <gtest/gtest.h>

#include "scene/format/scene_packing.h"
#include "scene/visibility/view_frustum.h"
#include "scene/visibility/z_buffer.h"
#include "support/samples/front_points.h"
#include "support/samples/synthetic_scene.h"

namespace {

using maq::DepthKey;
using maq::FittedPoints;
using maq::kNoPointKey;
using maq::PinholeCamera;
using maq::Scene;

Scene packed(const FittedPoints& points, maq::PositionFormat positions) {
  maq::ScenePacking packing;
  packing.positions = positions;
  packing.coefficients = maq::CoefficientFormat::kInt8;
  return make_scene(points, packing);
}

// Keys of a scene, its blocks dealt to `workers` in turn, from the last to the first where `is_reversed`.
std::vector<DepthKey> keys_of(const Scene& scene, const PinholeCamera& camera, double near, int workers = 1,
                              bool is_reversed = false, bool skips = false, uint32_t* drawn = nullptr) {
  static maq::ZBuffer buffer;  // with what an earlier image left
  buffer.begin(camera, near, workers);
  const maq::ViewFrustum frustum(camera, near);
  for (uint32_t i = 0; i < scene.block_count; ++i) {
    const maq::SceneBlock& block = scene.blocks[is_reversed ? scene.block_count - 1 - i : i];
    if (skips && !frustum.may_show(scene, block)) continue;
    if (drawn != nullptr) ++*drawn;
    buffer.draw(span_of(scene, block, camera.centre), int(i) % workers);
  }
  for (int row = 0; row < camera.height_px; ++row) buffer.finish(row, row + 1);
  return {buffer.keys(), buffer.keys() + size_t(camera.width_px) * size_t(camera.height_px)};
}

// Vector from the camera's centre to a stored point.
std::array<long double, 3> stored_position(const Scene& scene, uint32_t point, const PinholeCamera& camera) {
  const maq::SceneBlock* block = scene.blocks;
  while (point >= block->first + block->count) ++block;
  std::array<long double, 3> position;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const size_t at = 3 * size_t(block->first) + axis * block->count + (point - block->first);
    position[axis] = scene.position_format == maq::PositionFormat::kFloat32
                         ? static_cast<const float*>(scene.positions)[at]
                         : block->low[axis] + static_cast<const uint16_t*>(scene.positions)[at] *
                                                  (long double)(block->position_step[axis]);
    position[axis] += (long double)(scene.origin[axis]) - camera.centre[axis];
  }
  return position;
}

struct Projected {
  long double column, row, depth;
};
Projected reference(const Scene& scene, uint32_t point, const PinholeCamera& camera) {
  const std::array<long double, 3> d = stored_position(scene, point, camera);
  long double seen[3];
  for (size_t k = 0; k < 3; ++k) {
    seen[k] = camera.rotation[3 * k] * d[0] + camera.rotation[3 * k + 1] * d[1] + camera.rotation[3 * k + 2] * d[2];
  }
  return {seen[0] / seen[2] * camera.fx_px + camera.cx_px, seen[1] / seen[2] * camera.fy_px + camera.cy_px, seen[2]};
}

// Every point that is well inside of a pixel is visible there or behind the one that is; visible ones are in their
// pixel.
void expect_as_reference(const Scene& scene, const PinholeCamera& camera, double near) {
  constexpr long double kMinMove_px = 0.01L;
  const std::vector<DepthKey> keys = keys_of(scene, camera, near, 2);
  for (uint32_t point = 0; point < scene.points; ++point) {
    const Projected at = reference(scene, point, camera);
    if (!(at.depth > near * 1.000001L)) continue;
    const long double column = std::floor(at.column + 0.5L), row = std::floor(at.row + 0.5L);
    const bool near_edge = std::abs(at.column + 0.5L - std::round(at.column + 0.5L)) < kMinMove_px ||
                           std::abs(at.row + 0.5L - std::round(at.row + 0.5L)) < kMinMove_px;
    if (near_edge || column < 0 || row < 0 || column >= camera.width_px || row >= camera.height_px) continue;
    const DepthKey key = keys[size_t(row) * size_t(camera.width_px) + size_t(column)];
    ASSERT_NE(key, kNoPointKey) << "point " << point;
    ASSERT_LE(maq::depth_of(key), at.depth * 1.00001L) << "point " << point;
  }
  for (size_t pixel = 0; pixel < keys.size(); ++pixel) {
    if (keys[pixel] == kNoPointKey) continue;
    const Projected at = reference(scene, maq::point_of(keys[pixel]), camera);
    ASSERT_NEAR(double(at.column), double(pixel % size_t(camera.width_px)), 0.5 + double(kMinMove_px));
    ASSERT_NEAR(double(at.row), double(pixel / size_t(camera.width_px)), 0.5 + double(kMinMove_px));
    ASSERT_NEAR(double(maq::depth_of(keys[pixel]) / at.depth), 1, 1e-5);
  }
}

TEST(ZBuffer, BlocksShowWhatTheWholeCloudShows) {
  const FittedPoints points = synthetic_points(20000);
  const Scene scene = packed(points, maq::PositionFormat::kFloat32);
  std::mt19937 random(3);
  size_t seen = 0;
  for (int i = 0; i < 20; ++i) {
    const PinholeCamera camera = random_camera(random);
    const FrontPoints visible({points.x.data(), points.y.data(), points.z.data(), points.count(), points.origin},
                              camera, 0.1);
    const std::vector<DepthKey> keys = keys_of(scene, camera, 0.1, 3);
    ASSERT_EQ(keys.size(), visible.points.size());
    for (size_t pixel = 0; pixel < keys.size(); ++pixel) {
      const uint32_t front = visible.points[pixel];
      ASSERT_EQ(keys[pixel] == kNoPointKey, front == kNoPoint);
      if (front == kNoPoint) continue;
      ++seen;
      ASSERT_EQ(maq::depth_of(keys[pixel]), visible.depths[pixel]);
      const std::array<long double, 3> position = stored_position(scene, maq::point_of(keys[pixel]), camera);
      ASSERT_EQ(position[0], points.x[front] - (long double)(camera.centre[0]));
      ASSERT_EQ(position[1], points.y[front] - (long double)(camera.centre[1]));
    }
  }
  EXPECT_GT(seen, 500u);
}

TEST(ZBuffer, AnyNumberOfWorkersInAnyOrderDrawTheSamePicture) {
  // Eight points at each position: ties everywhere.
  const Scene scene = packed(synthetic_points(16000, 5, 1, {0, 0, 0}, 8), maq::PositionFormat::kUint16);
  std::mt19937 random(4);
  for (int i = 0; i < 20; ++i) {
    const PinholeCamera camera = random_camera(random);
    const std::vector<DepthKey> expected = keys_of(scene, camera, 0);
    for (const int workers : {1, 2, 3, 7}) {
      EXPECT_EQ(keys_of(scene, camera, 0, workers), expected);
      EXPECT_EQ(keys_of(scene, camera, 0, workers, true), expected);
    }
  }
}

TEST(ZBuffer, OfEqualsTheFirstIsVisibleAcrossBlocksAndWorkers) {
  FittedPoints points = synthetic_points(5000);
  for (size_t i = 0; i < points.count(); ++i) points.x[i] = points.y[i] = 0, points.z[i] = 2;
  for (const auto positions : {maq::PositionFormat::kFloat32, maq::PositionFormat::kUint16}) {
    const Scene scene = packed(points, positions);
    ASSERT_GT(scene.block_count, 4u);
    for (const int workers : {1, 2}) {
      const std::vector<DepthKey> keys = keys_of(scene, camera_of(3, 3, 60), 0.1, workers, true);
      EXPECT_EQ(maq::point_of(keys[4]), 0u);
      EXPECT_EQ(maq::depth_of(keys[4]), 2);
      EXPECT_EQ(keys[0], kNoPointKey);
    }
  }
}

TEST(ZBuffer, StoredPositionsInAnyUnitAndFarFromTheOriginOfTheWorld) {
  for (const auto positions : {maq::PositionFormat::kFloat32, maq::PositionFormat::kUint16}) {
    for (const double unit : {1e-3, 1.0, 1e6}) {
      for (const double away : {0.0, 1e6}) {
        const std::array<double, 3> origin = {away * unit, -away * unit, away * unit};
        const Scene scene = packed(synthetic_points(5000, 7, unit, origin), positions);
        PinholeCamera camera = camera_of(640, 480, 60);
        camera.rotation = rotation_of(1, 0.05, -0.1, 0.3);
        camera.centre = origin;
        expect_as_reference(scene, camera, 0.01 * unit);
      }
    }
  }
}

TEST(ZBuffer, StoredPositionsByCamerasOfEveryKind) {
  for (const auto positions : {maq::PositionFormat::kFloat32, maq::PositionFormat::kUint16}) {
    const Scene scene = packed(synthetic_points(4000, 9), positions);
    for (const double degrees : {1.0, 30.0, 60.0, 120.0, 170.0}) {
      for (const auto& [width, height] : {std::pair(640, 480), std::pair(33, 61), std::pair(1, 1), std::pair(1, 50)}) {
        PinholeCamera camera = camera_of(width, height, degrees);
        camera.rotation = rotation_of(1, 0.02, -0.02, 0.5);
        expect_as_reference(scene, camera, 0.01);
        camera.centre = {0.1, -0.2, 3};  // in the middle of the points
        expect_as_reference(scene, camera, 0.01);
        camera.fy_px *= 1.7;
        camera.cx_px += width;
        expect_as_reference(scene, camera, 0.01);
      }
    }
  }
}

TEST(ZBuffer, BlocksLeftOutShowNothing) {
  const Scene scene = packed(synthetic_points(30000, 11), maq::PositionFormat::kUint16);
  const Scene floats = packed(synthetic_points(30000, 11), maq::PositionFormat::kFloat32);
  std::mt19937 random(6);
  uint32_t drawn = 0, blocks = 0, unseen = 0;
  for (int i = 0; i < 300; ++i) {
    const PinholeCamera camera = random_camera(random);
    const double near = i % 3 == 0 ? 0 : 0.2 * double(i % 7);
    const std::vector<DepthKey> expected = keys_of(scene, camera, near);
    unseen += std::count(expected.begin(), expected.end(), kNoPointKey) == int64_t(expected.size()) ? 1 : 0;
    ASSERT_EQ(keys_of(scene, camera, near, 2, false, true, &drawn), expected) << i;
    blocks += scene.block_count;
    ASSERT_EQ(keys_of(floats, camera, near, 2, false, true), keys_of(floats, camera, near)) << i;
  }
  // Some see nothing, most see a part.
  EXPECT_LT(drawn, blocks / 2);
  EXPECT_GT(drawn, blocks / 50);
  EXPECT_GT(unseen, 0u);
}

TEST(ZBuffer, BlocksWhoseBoundsAreNotFiniteAreNotCulled) {
  Scene scene = packed(synthetic_points(100), maq::PositionFormat::kFloat32);
  maq::SceneBlock block = scene.blocks[0];
  block.low[1] = NAN;
  scene.blocks = &block;
  PinholeCamera camera = camera_of(10, 10, 60);
  EXPECT_TRUE(maq::ViewFrustum(camera, 0).may_show(scene, block));
}

TEST(ZBuffer, PointsThatBleedThroughANearerSurfaceAreRemoved) {
  // A sparse wall at depth 2 before a dense one at depth 4, in an image whose sides are no multiples of the blocks'.
  std::mt19937 random(3);
  std::uniform_real_distribution<float> position(-1, 1);
  std::vector<float> x, y, z;
  for (int i = 0; i < 4600; ++i) {
    const bool is_near = i >= 4000;
    x.push_back((is_near ? 1.2f : 2.4f) * position(random));
    y.push_back((is_near ? 1.2f : 2.4f) * position(random));
    z.push_back(is_near ? 2.0f : 4.0f);
  }
  const maq::PinholeCamera camera = camera_of(66, 46, 60);
  const auto drawn = [&](double fraction) {
    maq::ZBuffer buffer;
    buffer.begin(camera, 0, 1);
    for (uint32_t first = 0; first < x.size(); first += maq::PointSpan::kMaxPoints) {
      maq::PointSpan span;
      for (size_t axis = 0; axis < 3; ++axis) span.base[axis] = -camera.centre[axis];
      span.x = x.data() + first;
      span.y = y.data() + first;
      span.z = z.data() + first;
      span.first = first;
      span.count = std::min<uint32_t>(maq::PointSpan::kMaxPoints, uint32_t(x.size()) - first);
      buffer.draw(span, 0);
    }
    buffer.finish(0, 46);
    // In two parts, as threads do.
    buffer.remove_occluded(0, 16, fraction);
    buffer.remove_occluded(16, 46, fraction);
    return std::vector<maq::DepthKey>(buffer.keys(), buffer.keys() + 66 * 46);
  };
  const std::vector<maq::DepthKey> all = drawn(std::numeric_limits<double>::infinity()), left = drawn(0.1);
  size_t occluded = 0, kept = 0;
  for (int row = 0; row < 46; ++row) {
    for (int column = 0; column < 66; ++column) {
      const maq::DepthKey key = all[size_t(row * 66 + column)];
      float nearest = std::numeric_limits<float>::infinity();
      for (int r = row / 4 * 4; r < std::min(46, row / 4 * 4 + 4); ++r) {
        for (int c = column / 4 * 4; c < std::min(66, column / 4 * 4 + 4); ++c) {
          const maq::DepthKey other = all[size_t(r * 66 + c)];
          if (other != maq::kNoPointKey) nearest = std::min(nearest, maq::depth_of(other));
        }
      }
      const bool is_occluded = key != maq::kNoPointKey && maq::depth_of(key) > nearest * 1.1f;
      EXPECT_EQ(left[size_t(row * 66 + column)], is_occluded ? maq::kNoPointKey : key) << row << " " << column;
      (is_occluded ? occluded : kept) += key != maq::kNoPointKey ? 1 : 0;
    }
  }
  EXPECT_GT(occluded, 300u);
  EXPECT_GT(kept, 300u);
}

}  // namespace
