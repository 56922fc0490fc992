// Which part of a frame the refiner works on.
#include "scene/render/refiner_roi.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace {

using maq::kReceptiveFieldRadius_px;
using maq::RasterWindow;

TEST(RefinerRoi, HoldsAllThatTheRefinerSeesOfThePointsInAFewSizes) {
  std::mt19937 random(1);
  std::set<std::pair<int, int>> sizes;
  int smaller = 0;
  for (const auto& [width, height] :
       {std::pair(640, 480), std::pair(1280, 720), std::pair(2048, 16), std::pair(16, 16), std::pair(816, 1008)}) {
    sizes.clear();
    for (int i = 0; i < 2000; ++i) {
      const int cells_x = width / 16, cells_y = height / 16;
      RasterWindow seen;
      seen.left_px = 16 * int(random() % unsigned(cells_x));
      seen.top_px = 16 * int(random() % unsigned(cells_y));
      seen.width_px = 16 + 16 * int(random() % unsigned(cells_x - seen.left_px / 16));
      seen.height_px = 16 + 16 * int(random() % unsigned(cells_y - seen.top_px / 16));
      const RasterWindow window = maq::window_to_refine(seen, width, height);
      for (const int figure : {window.left_px, window.top_px, window.width_px, window.height_px}) {
        ASSERT_EQ(figure % 16, 0);
      }
      const int right = window.left_px + window.width_px, bottom = window.top_px + window.height_px;
      ASSERT_GE(window.left_px, 0);
      ASSERT_GE(window.top_px, 0);
      ASSERT_LE(right, width);
      ASSERT_LE(bottom, height);
      ASSERT_LE(window.left_px, std::max(0, seen.left_px - kReceptiveFieldRadius_px));
      ASSERT_LE(window.top_px, std::max(0, seen.top_px - kReceptiveFieldRadius_px));
      ASSERT_GE(right, std::min(width, seen.left_px + seen.width_px + kReceptiveFieldRadius_px));
      ASSERT_GE(bottom, std::min(height, seen.top_px + seen.height_px + kReceptiveFieldRadius_px));
      sizes.insert({window.width_px, window.height_px});
      smaller += window.width_px < width || window.height_px < height ? 1 : 0;
    }
    ASSERT_LE(sizes.size(), 16u);
  }
  EXPECT_GT(smaller, 1000);
}

TEST(RefinerRoi, IsTheWholeFrameWhereLittleWouldBeSaved) {
  const RasterWindow window = maq::window_to_refine({0, 0, 640, 448}, 640, 480);
  EXPECT_EQ(window.width_px, 640);
  EXPECT_EQ(window.height_px, 480);
  EXPECT_EQ(maq::window_to_refine({320, 240, 16, 16}, 640, 480).width_px, 320);
}

}  // namespace
