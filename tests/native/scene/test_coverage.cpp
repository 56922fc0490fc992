// Alpha and depth of an image against their definitions, pixel by pixel.
#include "scene/render/coverage.h"

#include <gtest/gtest.h>

#include "scene/format/scene_packing.h"
#include "support/samples/synthetic_scene.h"

namespace {

using maq::DepthKey;
using maq::DescriptorRaster;
using maq::kNoPointKey;

constexpr size_t kWidth = 112, kHeight = 80;

void shade(DescriptorRaster& raster, size_t count, maq::WorkerThreads& threads) {
  const maq::Scene scene = make_scene(synthetic_points(count), {});
  const maq::PinholeCamera camera = camera_of(int(kWidth), int(kHeight), 70);
  maq::ZBuffer buffer;
  buffer.begin(camera, 0.01, 1);
  for (uint32_t i = 0; i < scene.block_count; ++i) buffer.draw(span_of(scene, scene.blocks[i], camera.centre), 0);
  buffer.finish(0, int(kHeight));
  const maq::ViewBasis basis(std::vector<float>(maq::ViewBasis::kWeights, 0.0f));
  const maq::BlockIndex blocks(scene);
  const maq::RefinerLayout layout{5, true};
  raster.shade({scene, blocks, buffer, camera.centre, {0, 0, int(kWidth), int(kHeight)}, basis, layout}, threads);
}

// Alpha of the pixel (x, y) at a level, in double.
double alpha_at(const DescriptorRaster& raster, int level, int x, int y) {
  const double confidence[] = {255, 255, 255, 128, 64};
  const int width = int(kWidth) >> level, height = int(kHeight) >> level;
  const double own = raster.keys(level)[y * width + x] == kNoPointKey ? 0 : confidence[level];
  if (level == 4) return own;
  const auto coarser = [&](int at_x, int at_y) {
    return alpha_at(raster, level + 1, std::clamp(at_x, 0, width / 2 - 1), std::clamp(at_y, 0, height / 2 - 1));
  };
  const int in_x = x / 2, in_y = y / 2, beside_x = in_x + (x % 2 == 0 ? -1 : 1),
            beside_y = in_y + (y % 2 == 0 ? -1 : 1);
  return std::max(own, 0.5625 * coarser(in_x, in_y) + 0.1875 * coarser(beside_x, in_y) +
                           0.1875 * coarser(in_x, beside_y) + 0.0625 * coarser(beside_x, beside_y));
}

TEST(Coverage, IsAsItsDefinitionSays) {
  for (const size_t count : {1u, 40u, 3000u}) {
    maq::WorkerThreads threads(2);
    DescriptorRaster raster;
    shade(raster, count, threads);
    maq::Coverage coverage;
    coverage.find(raster, int(kWidth), int(kHeight), threads);
    for (size_t y = 0; y < kHeight; ++y) {
      for (size_t x = 0; x < kWidth; ++x) {
        // Each of four scales rounds.
        ASSERT_NEAR(coverage.alphas()[y * kWidth + x], alpha_at(raster, 0, int(x), int(y)), 2.01) << x << " " << y;
        float depth = 0;
        for (int level = 4; level >= 0; --level) {
          const DepthKey key = raster.keys(level)[(y >> level) * (kWidth >> level) + (x >> level)];
          if (key != kNoPointKey) depth = maq::depth_of(key);
        }
        ASSERT_EQ(coverage.depths()[y * kWidth + x], depth);
      }
    }
  }
}

TEST(Coverage, IsWholeWhereThereIsAPointAndNothingFarFromAll) {
  maq::WorkerThreads threads(1);
  DescriptorRaster raster;
  shade(raster, 1, threads);
  maq::Coverage coverage;
  coverage.find(raster, int(kWidth), int(kHeight), threads);
  size_t covered = 0, nothing = 0;
  for (size_t i = 0; i < kWidth * kHeight; ++i) {
    if (raster.keys(0)[i] != kNoPointKey) {
      EXPECT_EQ(coverage.alphas()[i], 255);
      ++covered;
    }
    nothing += coverage.alphas()[i] == 0 ? 1 : 0;
  }
  EXPECT_EQ(covered, 1u);
  EXPECT_GT(nothing, kWidth * kHeight * 3 / 4);
}

}  // namespace
