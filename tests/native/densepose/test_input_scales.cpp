// The choice of the input's size, and the selection of people from two sizes.
#include "densepose/detector/input_scales.h"

#include <gtest/gtest.h>

namespace {

using maq::InputScales;
using maq::ScoredBox;

constexpr int kNearPx = 288;

std::vector<ScoredBox> people_of(std::initializer_list<float> heights_px) {
  std::vector<ScoredBox> people;
  float left = 0;
  for (const float height : heights_px) {
    people.push_back({{left, 10, left + height / 3, 10 + height}, 0.9f});
    left += height / 2;
  }
  return people;
}

TEST(InputScales, ASmallImageIsNeverEnlarged) {
  const InputScales scales(kNearPx);
  EXPECT_EQ(scales.far_side_px(320, 0), 0);
  EXPECT_EQ(scales.far_side_px(400, 0), 400);
  EXPECT_EQ(scales.far_side_px(4000, 0), 480);
}

TEST(InputScales, PeopleWhomTheAppDoesNotAskForNeedNoLargerInput) {
  const InputScales scales(kNearPx);
  EXPECT_EQ(scales.far_side_px(1280, 600), 0);
  EXPECT_EQ(scales.far_side_px(1280, 300), 480);
}

TEST(InputScales, AStillImageGetsTheLargerInputForSmallPeopleAndForNobody) {
  InputScales scales(kNearPx);
  for (int repeat = 0; repeat < 3; ++repeat) {
    EXPECT_TRUE(scales.runs_near());
    EXPECT_FALSE(scales.runs_far(people_of({250, 180})));
    EXPECT_TRUE(scales.runs_far(people_of({250, 60})));
    scales.judge(people_of({250, 60}), true);
    EXPECT_TRUE(scales.runs_near()) << "earlier images do not count";
    EXPECT_TRUE(scales.runs_far({}));
  }
}

TEST(InputScales, AStreamStaysAtTheLargerInputWhilePeopleAreSmall) {
  InputScales scales(kNearPx);
  scales.set_stream(true);
  ASSERT_TRUE(scales.runs_near());
  ASSERT_TRUE(scales.runs_far(people_of({60})));
  scales.judge(people_of({60, 50}), true);
  int both = 0;
  for (int frame = 0; frame < 64; ++frame) {
    const bool near = scales.runs_near();
    both += near ? 1 : 0;
    if (near) {
      ASSERT_TRUE(scales.runs_far(people_of({60})));
    }
    scales.judge(people_of({60, 50}), near);
  }
  EXPECT_EQ(both, 4) << "a look at the smaller input in each 16th frame";
}

TEST(InputScales, AStreamLeavesTheLargerInputOnceNobodyIsSmall) {
  InputScales scales(kNearPx);
  scales.set_stream(true);
  scales.runs_far(people_of({60}));
  scales.judge(people_of({60}), true);
  scales.judge(people_of({105}), false);
  EXPECT_FALSE(scales.runs_near()) << "hysteresis: larger than small, but not by much";
  scales.judge(people_of({160}), false);
  ASSERT_TRUE(scales.runs_near());
  ASSERT_TRUE(scales.runs_far(people_of({160})));
  scales.judge(people_of({160}), true);
  EXPECT_TRUE(scales.runs_near());
  EXPECT_FALSE(scales.runs_far(people_of({160})));
}

TEST(InputScales, LargePeopleBesideSmallOnesAreLookedForAtTheSmallerInput) {
  InputScales scales(kNearPx);
  scales.set_stream(true);
  scales.runs_far(people_of({60, 250}));
  scales.judge(people_of({60, 250}), true);
  EXPECT_TRUE(scales.runs_near());
}

TEST(InputScales, AnEmptyStreamIsSearchedAtTheLargerInputNowAndThen) {
  InputScales scales(kNearPx);
  scales.set_stream(true);
  int far = 0;
  for (int frame = 0; frame < 32; ++frame) {
    ASSERT_TRUE(scales.runs_near());
    if (!scales.runs_far({})) continue;
    ++far;
    scales.judge({}, true);
  }
  EXPECT_EQ(far, 4);
}

TEST(InputScales, OneManAtADeskCostsTheSmallerInputOnly) {
  InputScales scales(kNearPx);
  scales.set_stream(true);
  for (int frame = 0; frame < 32; ++frame) {
    ASSERT_TRUE(scales.runs_near());
    ASSERT_FALSE(scales.runs_far(people_of({200})));
  }
}

struct Selected {
  std::vector<uint8_t> near, far;
};

Selected select(const std::vector<ScoredBox>& near, const std::vector<ScoredBox>& far, float to_near = 0.6f) {
  Selected selected;
  maq::select_people(near, far, to_near, selected.near, selected.far);
  return selected;
}

// A box in pixels of the larger input, for a box in pixels of the smaller one.
ScoredBox far_box(float x0, float y0, float x1, float y1) {
  return {{x0 / 0.6f, y0 / 0.6f, x1 / 0.6f, y1 / 0.6f}, 0.8f};
}

TEST(SelectPeople, ASmallPersonIsTakenFromTheLargerInputAndALargeOneFromTheSmaller) {
  const Selected kept =
      select({{{0, 0, 80, 240}, 0.9f}, {{150, 0, 170, 60}, 0.9f}}, {far_box(1, 1, 80, 240), far_box(150, 1, 171, 60)});
  EXPECT_EQ(kept.near, (std::vector<uint8_t>{1, 0}));
  EXPECT_EQ(kept.far, (std::vector<uint8_t>{0, 1}));
}

TEST(SelectPeople, PeopleOfOneInputAloneAreKept) {
  const Selected kept = select({{{0, 0, 20, 60}, 0.9f}}, {far_box(100, 0, 120, 50)});
  EXPECT_EQ(kept.near, (std::vector<uint8_t>{1}));
  EXPECT_EQ(kept.far, (std::vector<uint8_t>{1}));
}

TEST(SelectPeople, APartOfALargePersonIsNoFurtherPerson) {
  const Selected kept = select({{{0, 0, 100, 250}, 0.9f}}, {far_box(10, 20, 40, 100)});
  EXPECT_EQ(kept.far, (std::vector<uint8_t>{0}));
}

TEST(SelectPeople, ALargePersonOfTheLargerInputAloneIsDropped) {
  EXPECT_EQ(select({}, {far_box(0, 0, 90, 200)}).far, (std::vector<uint8_t>{0}));
}

TEST(SelectPeople, TwoBoxesOfTheLargerInputDoNotReplaceOnePersonTwice) {
  const Selected kept = select({{{0, 0, 20, 60}, 0.9f}}, {far_box(0, 0, 20, 58), far_box(1, 0, 22, 60)});
  EXPECT_EQ(kept.near, (std::vector<uint8_t>{0}));
  EXPECT_EQ(kept.far, (std::vector<uint8_t>{1, 0}));
}

}  // namespace
