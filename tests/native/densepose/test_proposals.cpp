#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "densepose/detector/proposals.h"

namespace {

using maq::Box;

maq::RpnSpec spec() {
  maq::RpnSpec spec;
  spec.strides = {4, 8, 16, 32, 64};
  spec.anchor_sizes_px = {32, 64, 128, 256, 512};
  spec.aspect_ratios = {0.5f, 1, 2};
  spec.pre_nms_top_k = 1000;
  spec.post_nms_top_k = 100;
  spec.nms_iou = 0.7f;
  return spec;
}

// One level of `width` x `height` cells whose logits are all `logit` and whose deltas are 0.
struct Level {
  Level(int columns, int rows, float everywhere)
      : values(size_t(15 * columns * rows), 0.0f), width(columns), height(rows) {
    for (int cell = 0; cell < columns * rows; ++cell) std::fill_n(values.begin() + 15 * cell, 3, everywhere);
  }
  float& logit(int x, int y, int anchor) { return values[size_t(15 * (y * width + x) + anchor)]; }
  float& delta(int x, int y, int anchor, int which) {
    return values[size_t(15 * (y * width + x) + 3 + 4 * anchor + which)];
  }
  maq::RpnLevel view() const { return {values.data(), width, height}; }

  std::vector<float> values;
  int width, height;
};

std::vector<maq::ScoredBox> select(const std::vector<maq::RpnLevel>& levels, const maq::RpnSpec& spec, float width,
                                   float height, int* dropped) {
  std::vector<maq::RpnCandidate> candidates(3);  // what they hold, and what is in `found`, is of no matter
  std::vector<maq::ScoredBox> found(2);
  select_proposals(levels, spec, spec.post_nms_top_k, width, height, candidates, found, dropped);
  return found;
}

TEST(Proposals, AnchorsAreCentredOnCellsAndKeepTheirArea) {
  const Box square = maq::anchor_box(3, 5, 8, 64, 1);
  EXPECT_FLOAT_EQ(square.x0, 24 - 32);
  EXPECT_FLOAT_EQ(square.y1, 40 + 32);
  const Box tall = maq::anchor_box(0, 0, 4, 32, 2);
  EXPECT_NEAR(tall.height() / tall.width(), 2, 1e-5);
  EXPECT_NEAR(tall.area(), 32 * 32, 1e-2);
}

TEST(Proposals, TheBestAnchorComesFirstMovedByItsDeltas) {
  Level level(20, 20, -5);
  level.logit(10, 12, 1) = 4;
  level.delta(10, 12, 1, 0) = 0.25f;
  int dropped = 0;
  const auto found = select({level.view()}, spec(), 80, 80, &dropped);
  ASSERT_FALSE(found.empty());
  EXPECT_FLOAT_EQ(found[0].score, 4);
  EXPECT_NEAR(found[0].box.x0, 40 + 8 - 16, 1e-4);
  EXPECT_NEAR(found[0].box.x1, 40 + 8 + 16, 1e-4);
  EXPECT_NEAR(found[0].box.y0, 48 - 16, 1e-4);
}

TEST(Proposals, EqualScoresGoByLevelThenRowThenColumnThenAnchor) {
  Level fine(4, 4, 1), coarse(2, 2, 1);
  maq::RpnSpec all = spec();
  all.nms_iou = 1;  // nothing suppressed
  int dropped = 0;
  const auto found = select({fine.view(), coarse.view()}, all, 16, 16, &dropped);
  ASSERT_EQ(found.size(), size_t(3 * (16 + 4)));
  for (size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].index, i < 48 ? int64_t(i) : (int64_t(1) << 32) + int64_t(i - 48));
  }
}

TEST(Proposals, EachLevelKeepsItsBestAndTheWholeItsLimit) {
  Level level(10, 10, 0);
  for (int i = 0; i < 100; ++i) level.logit(i % 10, i / 10, 1) = float(i);
  maq::RpnSpec few = spec();
  few.nms_iou = 1;
  few.pre_nms_top_k = 7;
  int dropped = 0;
  auto found = select({level.view()}, few, 1000, 1000, &dropped);
  ASSERT_EQ(found.size(), 7u);
  EXPECT_FLOAT_EQ(found[6].score, 93);
  few.post_nms_top_k = 3;
  found = select({level.view(), level.view()}, few, 1000, 1000, &dropped);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_FLOAT_EQ(found[0].score, 99);
  EXPECT_FLOAT_EQ(found[1].score, 99);
}

TEST(Proposals, NanAndBoxesWithoutAreaAreDroppedAndCounted) {
  Level level(4, 4, 0);
  level.logit(0, 0, 0) = std::nanf("");
  level.logit(0, 1, 0) = std::numeric_limits<float>::infinity();
  level.delta(1, 1, 1, 2) = std::nanf("");
  level.delta(2, 2, 1, 0) = 1e4f;
  level.delta(3, 3, 1, 1) = -1e4f;
  maq::RpnSpec all = spec();
  all.nms_iou = 1;
  int dropped = 0;
  const auto found = select({level.view()}, all, 16, 16, &dropped);
  EXPECT_EQ(dropped, 5);
  EXPECT_EQ(found.size(), size_t(48 - 5));
  for (const maq::ScoredBox& proposal : found) {
    EXPECT_TRUE(proposal.box.x0 >= 0 && proposal.box.x1 <= 16 && proposal.box.y0 >= 0 && proposal.box.y1 <= 16);
  }
}

TEST(Proposals, AModelThatIsAllNanGivesNothing) {
  Level level(8, 8, std::nanf(""));
  int dropped = 0;
  EXPECT_TRUE(select({level.view()}, spec(), 32, 32, &dropped).empty());
  EXPECT_EQ(dropped, 3 * 64);
}

}  // namespace
