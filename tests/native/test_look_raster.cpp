// The refiner's input against drawing every scale by itself.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "expect_error.h"
#include "scene/look_raster.h"

namespace {

using maq::kBasis;
using maq::kFeatures;
using maq::LookRaster;

struct Scene {
  explicit Scene(size_t count, unsigned seed = 1) : random(seed) {
    std::uniform_real_distribution<float> across(-1.5f, 1.5f), depth(1.5f, 5.0f);
    for (size_t i = 0; i < count; ++i) {
      x.push_back(across(random));
      y.push_back(across(random));
      z.push_back(std::round(depth(random) * 8) / 8);  // many are equally deep
    }
    for (size_t i = 0; i < count * kFeatures; ++i) means.push_back(across(random));
    for (size_t i = 0; i < count * kFeatures * kBasis; ++i) slopes.push_back(across(random));
    weights.resize(maq::ViewBasis::kWeights);
    for (float& weight : weights) weight = across(random) * 0.3f;
  }
  maq::PointPlaces places() const { return {x.data(), y.data(), z.data(), x.size(), {0, 0, 0}}; }
  // The look of a point, by its formula.
  std::vector<double> look(size_t point, const maq::PinholeCamera& camera) const {
    const double d[3] = {x[point] - camera.centre[0], y[point] - camera.centre[1], z[point] - camera.centre[2]};
    const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    const float unit[3] = {float(d[0] / length), float(d[1] / length), float(d[2] / length)};
    float h[kBasis];
    maq::ViewBasis(weights).evaluate(&unit[0], &unit[1], &unit[2], 1, h);
    std::vector<double> look;
    for (int c = 0; c < kFeatures; ++c) {
      double value = means[point * kFeatures + size_t(c)];
      for (int k = 0; k < kBasis; ++k) {
        value += double(h[k]) * slopes[(point * kBasis + size_t(k)) * kFeatures + size_t(c)];
      }
      look.push_back(value);
    }
    return look;
  }
  std::mt19937 random;
  std::vector<float> x, y, z, means, slopes, weights;
};

maq::PinholeCamera camera_of(int width, int height) {
  maq::PinholeCamera camera;
  camera.width_px = width;
  camera.height_px = height;
  camera.fx_px = camera.fy_px = width;
  camera.cx_px = (width - 1) / 2.0;
  camera.cy_px = (height - 1) / 2.0;
  camera.centre = {0.1, -0.05, 0.2};
  return camera;
}

TEST(LookRaster, EveryScaleIsWhatACameraOfThatSizeSees) {
  for (const size_t count : {0u, 1u, 300u, 20000u}) {
    const Scene scene(count);
    const maq::PinholeCamera camera = camera_of(96, 64);
    maq::VisiblePoints visible;
    visible.find(scene.places(), camera, 0.01);
    LookRaster raster;
    raster.shade(visible, scene.places(), {scene.means.data(), scene.slopes.data()}, maq::ViewBasis(scene.weights),
                 camera);
    EXPECT_EQ(raster.shaded(), size_t(std::count_if(visible.winners().begin(), visible.winners().end(),
                                                    [](uint32_t winner) { return winner != maq::kNoPoint; })));
    for (int level = 0; level < LookRaster::kLevels; ++level) {
      const int width = 96 >> level, height = 64 >> level;
      maq::VisiblePoints small;
      small.find(scene.places(), maq::resized(camera, width, height), 0.01);
      const std::vector<float>& found = raster.level(level);
      const size_t plane = size_t(width) * size_t(height);
      ASSERT_EQ(found.size(), plane * LookRaster::kChannels);
      for (size_t pixel = 0; pixel < plane; ++pixel) {
        const uint32_t winner = small.winners()[pixel];
        ASSERT_EQ(found[kFeatures * plane + pixel], winner == maq::kNoPoint ? 0 : 1) << level;
        const std::vector<double> expected =
            winner == maq::kNoPoint ? std::vector<double>(kFeatures, 0.0) : scene.look(winner, camera);
        for (size_t c = 0; c < size_t(kFeatures); ++c) {
          ASSERT_NEAR(found[c * plane + pixel], expected[c], 1e-4) << level << " " << pixel;
        }
      }
    }
  }
}

TEST(LookRaster, WithoutSlopesALookIsItsMean) {
  const Scene scene(500);
  const maq::PinholeCamera camera = camera_of(32, 32);
  maq::VisiblePoints visible;
  visible.find(scene.places(), camera, 0.01);
  LookRaster raster;
  raster.shade(visible, scene.places(), {scene.means.data(), nullptr}, maq::ViewBasis(scene.weights), camera);
  for (size_t pixel = 0; pixel < 32 * 32; ++pixel) {
    const uint32_t winner = visible.winners()[pixel];
    if (winner == maq::kNoPoint) continue;
    EXPECT_EQ(raster.level(0)[pixel], scene.means[winner * kFeatures]);
  }
}

TEST(LookRaster, SidesThatCannotBeHalvedAreRefused) {
  const Scene scene(5);
  const maq::PinholeCamera camera = camera_of(40, 32);
  maq::VisiblePoints visible;
  visible.find(scene.places(), camera, 0.01);
  LookRaster raster;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "40 x 32 pixels cannot be halved four times", [&] {
    raster.shade(visible, scene.places(), {scene.means.data(), nullptr}, maq::ViewBasis(scene.weights), camera);
  });
}

}  // namespace
