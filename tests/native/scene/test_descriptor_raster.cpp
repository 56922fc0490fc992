// The refiner's input against drawing every scale by itself.
#include "scene/render/descriptor_raster.h"

#include <gtest/gtest.h>

#include "scene/format/scene_packing.h"
#include "support/expect_error.h"
#include "support/samples/synthetic_scene.h"

namespace {

using maq::DepthKey;
using maq::DescriptorRaster;
using maq::kBasis;
using maq::kFeatures;
using maq::kNoPointKey;
using maq::RasterWindow;
using maq::Scene;

constexpr size_t kChannels = DescriptorRaster::kChannels;

const maq::ViewBasis& basis() {
  static const maq::ViewBasis made([] {
    std::mt19937 random(2);
    std::normal_distribution<float> normal;
    std::vector<float> weights(maq::ViewBasis::kWeights);
    for (float& weight : weights) weight = 0.4f * normal(random);
    return weights;
  }());
  return made;
}

template <class Stored>
double stored(const void* values, size_t at) {
  return double(static_cast<const Stored*>(values)[at]);
}
double coefficient(const Scene& scene, const void* values, size_t at) {
  switch (scene.coefficient_format) {
    case maq::CoefficientFormat::kFloat32: return stored<float>(values, at);
    case maq::CoefficientFormat::kInt16: return stored<int16_t>(values, at);
    default: return stored<int8_t>(values, at);
  }
}
double coordinate(const Scene& scene, size_t at) {
  return scene.position_format == maq::PositionFormat::kFloat32 ? stored<float>(scene.positions, at)
                                                                : stored<uint16_t>(scene.positions, at);
}

// The descriptor of a point from a camera's centre, by its formula, from what the scene's header says of stored
// numbers.
std::array<double, kFeatures> look_of(const Scene& scene, uint32_t point, const maq::PinholeCamera& camera) {
  const maq::SceneBlock* block = scene.blocks;
  while (point >= block->first + block->count) ++block;
  const size_t in_block = point - block->first;
  const bool is_float = scene.coefficient_format == maq::CoefficientFormat::kFloat32;
  double d[3], length = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    d[axis] = coordinate(scene, 3 * size_t(block->first) + axis * block->count + in_block);
    if (scene.position_format == maq::PositionFormat::kUint16)
      d[axis] = block->low[axis] + d[axis] * block->position_step[axis];
    d[axis] += scene.origin[axis] - camera.centre[axis];
    length += d[axis] * d[axis];
  }
  float unit[3], h[kBasis];
  for (size_t axis = 0; axis < 3; ++axis) unit[axis] = float(d[axis] / std::sqrt(length));
  basis().evaluate(&unit[0], &unit[1], &unit[2], 1, h);
  std::array<double, kFeatures> descriptor;
  for (size_t c = 0; c < size_t(kFeatures); ++c) {
    descriptor[c] = coefficient(scene, scene.constant_terms, point * size_t(kFeatures) + c);
    if (!is_float) descriptor[c] = block->constant_middle[c] + descriptor[c] * block->constant_step[c];
    if (in_block >= block->view_dependent) continue;
    for (size_t k = 0; k < size_t(kBasis); ++k) {
      const size_t at = k * kFeatures + c;
      const double linear =
          coefficient(scene, scene.linear_terms, (block->first_view_dependent + in_block) * kBasis * kFeatures + at);
      descriptor[c] += h[k] * linear * (is_float ? 1 : double(block->linear_step[at]));
    }
  }
  return descriptor;
}

struct View {
  View(const Scene& scene, const maq::PinholeCamera& camera, const RasterWindow& window, maq::RefinerLayout layout,
       int threads = 2)
      : layout_(layout), window_(window), workers(threads) {
    buffer.begin(camera, 0.01, 1);
    for (uint32_t i = 0; i < scene.block_count; ++i) buffer.draw(span_of(scene, scene.blocks[i], camera.centre), 0);
    buffer.finish(0, camera.height_px);
    const maq::BlockIndex blocks(scene);
    raster.shade({scene, blocks, buffer, camera.centre, window, basis(), layout}, workers);
  }
  // The descriptor of a pixel of the window at a level.
  const float* at(int level, size_t x, size_t y) const {
    const size_t width = size_t(window_.width_px) >> level;
    const size_t pixel =
        level == 0 && layout_.is_space_to_depth ? 4 * (y / 2 * (width / 2) + x / 2) + y % 2 * 2 + x % 2 : y * width + x;
    return raster.level(level) + kChannels * pixel;
  }
  maq::RefinerLayout layout_;
  RasterWindow window_;
  maq::WorkerThreads workers;
  maq::ZBuffer buffer;
  DescriptorRaster raster;
};

Scene packed(size_t count, maq::CoefficientFormat coefficients, size_t copies = 1) {
  maq::ScenePacking packing;
  packing.coefficients = coefficients;
  packing.positions =
      coefficients == maq::CoefficientFormat::kFloat32 ? maq::PositionFormat::kFloat32 : maq::PositionFormat::kUint16;
  return make_scene(synthetic_points(count, 1, 1, {1, 2, 3}, copies), packing);
}

maq::PinholeCamera camera_near(int width, int height) {
  maq::PinholeCamera camera = camera_of(width, height, 55);
  camera.centre = {1.1, 1.95, 3.2};
  return camera;
}

TEST(DescriptorRaster, EveryScaleIsWhatACameraOfThatSizeSees) {
  for (const auto kind :
       {maq::CoefficientFormat::kFloat32, maq::CoefficientFormat::kInt16, maq::CoefficientFormat::kInt8}) {
    for (const size_t count : {1u, 300u, 20000u}) {
      const Scene scene = packed(count, kind, count > 1 ? 3 : 1);
      const maq::PinholeCamera camera = camera_near(96, 64);
      for (const maq::RefinerLayout layout : {maq::RefinerLayout{5, true}, maq::RefinerLayout{3, false}}) {
        const View view(scene, camera, {0, 0, 96, 64}, layout);
        const auto seen = std::count_if(view.buffer.keys(), view.buffer.keys() + 96 * 64,
                                        [](DepthKey key) { return key != kNoPointKey; });
        EXPECT_EQ(view.raster.shaded(), size_t(seen));
        EXPECT_LE(view.raster.view_dependent(), view.raster.shaded());
        for (int level = 0; level < DescriptorRaster::kLevels; ++level) {
          const size_t width = 96u >> level, height = 64u >> level;
          maq::ZBuffer small;
          small.begin(maq::resized(camera, int(width), int(height)), 0.01, 1);
          for (uint32_t i = 0; i < scene.block_count; ++i)
            small.draw(span_of(scene, scene.blocks[i], camera.centre), 0);
          small.finish(0, int(height));
          for (size_t y = 0; y < height; ++y) {
            for (size_t x = 0; x < width; ++x) {
              const DepthKey key = small.keys()[y * width + x];
              ASSERT_EQ(view.raster.keys(level)[y * width + x], key) << level;
              const float* found = view.at(level, x, y);
              ASSERT_EQ(found[kFeatures], key == kNoPointKey ? 0 : 1) << level;
              std::array<double, kFeatures> expected{};
              if (key != kNoPointKey) {
                expected = look_of(scene, maq::point_of(key), camera);
              } else if (level + 1 < DescriptorRaster::kLevels) {
                std::copy_n(view.at(level + 1, x / 2, y / 2), DescriptorRaster::kColours, expected.begin());
              } else {
                std::copy_n(scene.background.begin(), DescriptorRaster::kColours, expected.begin());
              }
              for (size_t c = 0; c < size_t(kFeatures); ++c) ASSERT_NEAR(found[c], expected[c], 1e-4) << level;
            }
          }
        }
      }
    }
  }
}

TEST(DescriptorRaster, WithoutLinearTermsADescriptorIsItsConstantTerm) {
  maq::FittedPoints points = synthetic_points(500);
  std::fill(points.linear_terms.begin(), points.linear_terms.end(), 0.0f);
  maq::ScenePacking packing;
  packing.coefficients = maq::CoefficientFormat::kFloat32;
  const Scene scene = make_scene(points, packing);
  const View view(scene, camera_of(32, 32, 60), {0, 0, 32, 32}, {5, false});
  EXPECT_GT(view.raster.shaded(), 100u);
  EXPECT_EQ(view.raster.view_dependent(), 0u);
  for (size_t pixel = 0; pixel < 32 * 32; ++pixel) {
    const DepthKey key = view.raster.keys(0)[pixel];
    if (key == kNoPointKey) continue;
    EXPECT_EQ(view.at(0, pixel % 32, pixel / 32)[0],
              static_cast<const float*>(scene.constant_terms)[maq::point_of(key) * kFeatures]);
  }
}

TEST(DescriptorRaster, AWindowHasThatPartOfThePictureWithAnyNumberOfThreads) {
  const Scene scene = packed(20000, maq::CoefficientFormat::kInt8);
  const maq::PinholeCamera camera = camera_near(160, 128);
  for (const bool is_space_to_depth : {true, false}) {
    const View whole(scene, camera, {0, 0, 160, 128}, {5, is_space_to_depth}, 1);
    for (const int threads : {1, 2, 3}) {
      const View part(scene, camera, {48, 16, 96, 64}, {5, is_space_to_depth}, threads);
      for (int level = 0; level < DescriptorRaster::kLevels; ++level) {
        for (size_t y = 0; y < 64u >> level; ++y) {
          for (size_t x = 0; x < 96u >> level; ++x) {
            const float* expected = whole.at(level, x + (48u >> level), y + (16u >> level));
            ASSERT_TRUE(std::equal(expected, expected + kChannels, part.at(level, x, y))) << level;
          }
        }
      }
    }
  }
}

TEST(DescriptorRaster, MemoryOfAnEarlierPictureIsNotSeen) {
  const Scene scene = packed(5000, maq::CoefficientFormat::kInt8);
  View view(scene, camera_near(96, 64), {0, 0, 96, 64}, {5, true});
  ASSERT_GT(view.raster.shaded(), 0u);
  maq::PinholeCamera away = camera_near(96, 64);
  away.rotation = {-1, 0, 0, 0, 1, 0, 0, 0, -1};
  view.buffer.begin(away, 0.01, 1);
  view.buffer.finish(0, 64);
  const maq::BlockIndex blocks(scene);
  const maq::RefinerLayout layout{5, true};
  view.raster.shade({scene, blocks, view.buffer, away.centre, {0, 0, 96, 64}, basis(), layout}, view.workers);
  EXPECT_EQ(view.raster.shaded(), 0u);
  for (int level = 0; level < DescriptorRaster::kLevels; ++level) {
    const float* values = view.raster.level(level);
    for (size_t pixel = 0; pixel < size_t((96 * 64) >> (2 * level)); ++pixel) {
      for (size_t c = 0; c < kChannels; ++c) {
        const float expected = c < DescriptorRaster::kColours ? scene.background[c] : 0;
        ASSERT_EQ(values[pixel * kChannels + c], expected) << level << " " << pixel;
      }
    }
  }
}

TEST(DescriptorRaster, WindowsThatCannotBeHalvedOrAreOutsideAreRefused) {
  const Scene scene = packed(5, maq::CoefficientFormat::kInt8);
  const maq::PinholeCamera camera = camera_of(48, 32, 60);
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "40 x 32 pixels cannot be halved four times", [&] {
    View(scene, camera, {0, 0, 40, 32}, {5, true});
  });
  for (const RasterWindow window : {RasterWindow{16, 0, 48, 32}, {0, -16, 48, 32}, {0, 16, 48, 32}}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "is not inside of a picture of 48 x 32", [&] {
      View(scene, camera, window, {5, true});
    });
  }
}

}  // namespace
