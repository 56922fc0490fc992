// People of a stream stay with lower scores.
#include "densepose/detector/shown_people.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace shown_people_tests {
namespace {

using Boxes = std::vector<maq::ScoredBox>;

constexpr float kEnoughScore = 0.6f;
// The network's input is half as large as the image.
const maq::AffineMap kTwiceAsLarge{2, 0, 0, 0, 2, 0};

maq::ScoredBox person(float x, float score) { return {{x, 0, x + 20, 60}, score, 0, false}; }
maq::Box box_in_image(float x) { return {2 * x, 0, 2 * x + 40, 120}; }

Boxes marked(const std::vector<maq::Box>& shown, Boxes found) {
  maq::mark_shown(shown, kTwiceAsLarge, kEnoughScore, found);
  return found;
}

TEST(ShownPeople, ALowScoreIsKeptOnlyWhereAPersonWasShown) {
  const Boxes found = marked({box_in_image(2)}, {person(100, 0.9f), person(0, 0.5f), person(50, 0.5f)});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_FALSE(found[0].was_shown) << "new, with a sufficient score";
  EXPECT_EQ(found[1].box.x0, 0);
  EXPECT_TRUE(found[1].was_shown);
}

TEST(ShownPeople, APersonWhoWasShownIsOneBoxTheBest) {
  const Boxes found = marked({box_in_image(0)}, {person(1, 0.9f), person(3, 0.5f)});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].score, 0.9f);
}

TEST(ShownPeople, TwoPeopleWhoMeetBothStay) {
  const Boxes found = marked({box_in_image(0), box_in_image(4)}, {person(1, 0.55f), person(3, 0.5f)});
  EXPECT_EQ(found.size(), 2u);
}

TEST(ShownPeople, WithoutAnybodyBeforeTheThresholdDecidesAndItselfIsTooLow) {
  EXPECT_EQ(marked({}, {person(0, 0.61f), person(50, kEnoughScore)}).size(), 1u);
  EXPECT_TRUE(marked({box_in_image(0)}, {}).empty());
}

TEST(ShownPeople, ARotatedInputIsComparedInTheImage) {
  // A quarter turn: the input's x axis points down in the image.
  const maq::AffineMap quarter{0, -1, 60, 1, 0, 0};
  Boxes found = {person(0, 0.5f)};
  maq::mark_shown({{0, 0, 60, 20}}, quarter, kEnoughScore, found);
  EXPECT_EQ(found.size(), 1u);
  found = {person(0, 0.5f)};
  maq::mark_shown({{0, 0, 20, 60}}, quarter, kEnoughScore, found);
  EXPECT_TRUE(found.empty());
}

TEST(ShownPeople, BoxesWithoutAreaAndNotANumberMatchNobody) {
  const float nan = std::nanf("");
  EXPECT_TRUE(marked({{nan, nan, nan, nan}, {5, 5, 5, 5}}, {person(0, 0.5f)}).empty());
  EXPECT_GT(maq::kept_score(kEnoughScore), 0);
  EXPECT_LT(maq::kept_score(kEnoughScore), kEnoughScore);
}

}  // namespace
}  // namespace shown_people_tests
