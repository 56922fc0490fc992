#include "densepose/surface/steady_labels.h"

#include <gtest/gtest.h>

namespace {

constexpr int kSize = 2, kCoarse = 2, kIndex = 3, kClasses = kCoarse + kIndex;
constexpr float kThreshold = 0.5f;

// Four cells, each with logits of background, person, (background of the index,) part 0 and part 1.
class SteadyLabels : public ::testing::Test {
 protected:
  SteadyLabels() : labels_(size_t(kSize * kSize * kClasses)) { view_.shift_x = 7; }

  maq::DenseLogits logits() const { return {labels_.data(), nullptr, kCoarse, kIndex, kSize}; }

  void set(float person, float second_part) {
    for (int cell = 0; cell < kSize * kSize; ++cell) {
      float* const values = labels_.data() + cell * kClasses;
      values[0] = 0, values[1] = person, values[2] = 0, values[3] = 0, values[4] = second_part;
    }
  }

  // Shows the labels in the next frame; returns the part of the cells, -1 for background.
  int next(const maq::AffineMap& view, bool is_stream = true) {
    steady_.begin(is_stream);
    steady_.favour(view, logits(), labels_.data());
    classify_cells(logits(), memory_);
    steady_.keep(view, kThreshold, memory_);
    const bool is_person = memory_.odds[3] > maq::min_log_odds(kThreshold);
    return is_person ? memory_.best[3] : -1;
  }

  std::vector<float> labels_;
  maq::AffineMap view_;
  maq::SteadyLabels steady_;
  maq::DecodeMemory memory_;
};

TEST_F(SteadyLabels, APartStaysUntilAnotherIsClearlyMoreLikely) {
  set(5, -1);
  EXPECT_EQ(next(view_), 0);
  for (int i = 0; i < 3; ++i) {  // what was added counts once
    set(5, 0.6f);
    EXPECT_EQ(next(view_), 0);
  }
  set(5, 3);
  EXPECT_EQ(next(view_), 1);
  set(5, -0.6f);
  EXPECT_EQ(next(view_), 1);
}

TEST_F(SteadyLabels, TheOutlineStaysUntilItIsClearlyElsewhere) {
  set(1, 1);
  EXPECT_EQ(next(view_), 1);
  set(-0.6f, 1);
  EXPECT_EQ(next(view_), 1);
  set(-3, 1);
  EXPECT_EQ(next(view_), -1);
  set(0.6f, 1);
  EXPECT_EQ(next(view_), -1);
}

TEST_F(SteadyLabels, AnotherViewAnotherStreamAndAFrameWithoutThePersonBeginAnew) {
  maq::AffineMap moved = view_;
  moved.yy = 1.5;
  for (const bool is_stream : {true, false}) {
    set(5, -1);
    EXPECT_EQ(next(view_, is_stream), 0);
    set(5, 0.6f);
    EXPECT_EQ(next(is_stream ? moved : view_, is_stream), 1);
  }
  set(5, -1);
  EXPECT_EQ(next(view_, false), 0);
  steady_.begin(true);  // the person was not painted
  set(5, 0.6f);
  EXPECT_EQ(next(view_), 1);
}

TEST_F(SteadyLabels, APersonOfAnotherSizeOfCellsIsLeftAlone) {
  set(5, -1);
  EXPECT_EQ(next(view_), 0);
  steady_.begin(true);
  std::vector<float> larger(4 * labels_.size(), 1);
  const std::vector<float> before = larger;
  steady_.favour(view_, {larger.data(), nullptr, kCoarse, kIndex, 2 * kSize}, larger.data());
  EXPECT_EQ(larger, before);
}

}  // namespace
