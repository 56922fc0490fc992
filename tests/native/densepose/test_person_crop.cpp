#include <gtest/gtest.h>

#include <cmath>

#include "densepose/crops/person_crop.h"

namespace {

using maq::Box;
using maq::Point;

constexpr int kCells = 64, kCoarseParts = 15, kIndexParts = 25;
constexpr double kRadians = 0.017453292519943295;

// A doll in an image: a torso whose U falls from 1 at the hips to 0 at the neck, and a head above it, about `middle`,
// rotated by `lean` degrees (clockwise); seen by a dense head through `box`.
class Doll : public maq::ChartValues {
 public:
  Doll(const Point& middle, double lean, const Box& box) : middle_(middle), lean_(lean), box_(box) {
    labels_.resize(size_t(kCells * kCells * (kCoarseParts + kIndexParts)));
    for (int row = 0; row < kCells; ++row) {
      for (int column = 0; column < kCells; ++column) {
        const Point at = on_body(row, column);
        const bool is_torso = std::abs(at.x) < 20 && std::abs(at.y) < 40;
        const bool is_head = std::abs(at.x) < 10 && at.y > 40 && at.y < 65;
        const size_t four = size_t((row / 2) * (kCells / 2) + column / 2);
        float* cell = labels_.data() + (four * 4 + size_t(row % 2 * 2 + column % 2)) * (kCoarseParts + kIndexParts);
        cell[1] = is_torso || is_head ? 5.0f : -50.0f;
        for (int c = 2; c < kCoarseParts; ++c) cell[c] = -50;
        cell[kCoarseParts + (is_head ? 23 : is_torso ? 2 : 5)] = 5;
      }
    }
    classify_cells(logits(), memory_);
  }

  maq::DenseLogits logits() { return {labels_.data(), this, kCoarseParts, kIndexParts, kCells}; }
  maq::ChartPoint at(int part, int row, int column) override {
    if (part != 1) return {0.5f, 0.5f};
    return {has_u_ ? float(0.5 - on_body(row, column).y / 80) : NAN, 0.5f};
  }
  void lose_u() { has_u_ = false; }

  std::optional<Point> axis() { return find_body_axis(logits(), map(), 0.5f, memory_); }
  maq::PersonCrop crop(const std::optional<Point>& axis, double margin = 0) {
    return crop_around_person(kCells, map(), axis, 0.5f, margin, 256, memory_);
  }
  maq::DecodeMemory& memory() { return memory_; }
  maq::AffineMap map() const { return maq::map_of_cells(box_, kCells); }

  // Where a point of the body (x to the right, y from hips to head) lies in the image.
  Point in_image(double x, double y) const {
    const double c = std::cos(lean_ * kRadians), s = std::sin(lean_ * kRadians);
    return {middle_.x + c * x + s * y, middle_.y + s * x - c * y};
  }

 private:
  Point on_body(int row, int column) const {
    const double x = double(box_.x0) + (column + 0.5) * double(box_.width()) / kCells - middle_.x;
    const double y = double(box_.y0) + (row + 0.5) * double(box_.height()) / kCells - middle_.y;
    const double c = std::cos(lean_ * kRadians), s = std::sin(lean_ * kRadians);
    return {c * x + s * y, s * x - c * y};
  }

  Point middle_;
  double lean_;
  Box box_;
  bool has_u_ = true;
  std::vector<float> labels_;
  maq::DecodeMemory memory_;
};

const Box kWideBox{100, 50, 300, 210};

double degrees_between(const Point& a, const Point& b) {
  return std::acos(std::min(1.0, a.x * b.x + a.y * b.y)) / kRadians;
}

TEST(PersonCrop, TheAxisPointsFromHipsToHeadWhateverTheBoxsShape) {
  for (const double lean : {0.0, 20.0, 75.0, -110.0, 180.0}) {
    Doll doll({200, 130}, lean, kWideBox);
    ASSERT_TRUE(doll.axis()) << lean;
    EXPECT_LT(degrees_between(*doll.axis(), {std::sin(lean * kRadians), -std::cos(lean * kRadians)}), 1) << lean;
  }
}

TEST(PersonCrop, WithoutATorsoThereIsNoAxis) {
  Doll doll({200, 130}, 40, {196, 60, 204, 80});  // the box shows the head alone
  EXPECT_FALSE(doll.axis());
  Doll outside({1000, 1000}, 0, kWideBox);
  EXPECT_FALSE(outside.axis());
}

TEST(PersonCrop, AFaceWithSomeCellsOfTheShouldersHasNoAxis) {
  for (const float bottom : {92.0f, 125.0f}) {  // the torso begins at 90 and is 40 px wide, the head 25 high
    Doll doll({200, 130}, 0, {175, 60, 225, bottom});
    EXPECT_EQ(doll.axis().has_value(), bottom == 125);
  }
}

TEST(PersonCrop, UThatIsNoNumberLeavesTheDirectionOfTheHead) {
  Doll doll({200, 130}, 60, kWideBox);
  doll.lose_u();
  ASSERT_TRUE(doll.axis());
  EXPECT_LT(degrees_between(*doll.axis(), {std::sin(60 * kRadians), -std::cos(60 * kRadians)}), 2);
}

TEST(PersonCrop, ALeaningPersonStandsUprightInTheMiddleOfTheCrop) {
  for (const double lean : {25.0, -90.0, 170.0}) {
    Doll doll({200, 130}, lean, kWideBox);
    const maq::PersonCrop crop = doll.crop(doll.axis());
    ASSERT_TRUE(crop.is_rotated);
    const Point hips = crop.to_crop(doll.in_image(0, -40)), crown = crop.to_crop(doll.in_image(0, 65));
    EXPECT_NEAR(hips.x, crown.x, 5) << lean;
    EXPECT_NEAR(hips.x, 128, 6);
    // From hips to crown are 105 px, of which the crop's side is 1.15.
    EXPECT_NEAR(hips.y - crown.y, 256 / 1.15, 10) << lean;
    EXPECT_NEAR(double(crop.box.y0), crown.y, 6);
    EXPECT_NEAR(double(crop.box.y1), hips.y, 6);
    EXPECT_NEAR(double(crop.box.width()), 40 * 256 / 1.15 / 105, 12);
    const Point there_and_back = crop.to_image(crop.to_crop({17, 23}));
    EXPECT_NEAR(there_and_back.x, 17, 1e-9);
    EXPECT_NEAR(there_and_back.y, 23, 1e-9);
    const Point corner = crop.to_cells(kCells)(crop.to_image({double(crop.box.x0), double(crop.box.y1)}));
    EXPECT_NEAR(corner.x, 0, 1e-5);
    EXPECT_NEAR(corner.y, kCells, 1e-5);
  }
}

// The box of a crop that is not rotated.
Box box_in_image(const maq::PersonCrop& crop) {
  const Point low = crop.to_image({crop.box.x0, crop.box.y0}), high = crop.to_image({crop.box.x1, crop.box.y1});
  return {float(low.x), float(low.y), float(high.x), float(high.y)};
}

TEST(PersonCrop, WhoLeansLittleOrHasNoAxisIsNotTurned) {
  for (const double lean : {0.0, 9.0, -9.0}) {
    Doll doll({200, 130}, lean, kWideBox);
    EXPECT_FALSE(doll.crop(doll.axis()).is_rotated) << lean;
  }
  Doll doll({200, 130}, 0, kWideBox);
  const maq::PersonCrop crop = doll.crop(std::nullopt);
  EXPECT_FALSE(crop.is_rotated);
  const Box box = box_in_image(crop);
  EXPECT_NEAR(box.x0, 180, 4);
  EXPECT_NEAR(box.x1, 220, 4);
  EXPECT_NEAR(box.y0, 65, 3);
  EXPECT_NEAR(box.y1, 170, 3);
}

TEST(PersonCrop, AMarginMakesRoomForMotionOnAllSides) {
  Doll doll({200, 130}, 0, kWideBox);
  const Box tight = box_in_image(doll.crop(std::nullopt)), wide = box_in_image(doll.crop(std::nullopt, 0.1));
  const float room = 0.1f * tight.height();
  EXPECT_NEAR(wide.x0, tight.x0 - room, 0.1);
  EXPECT_NEAR(wide.y0, tight.y0 - room, 0.1);
  EXPECT_NEAR(wide.x1, tight.x1 + room, 0.1);
  EXPECT_NEAR(wide.y1, tight.y1 + room, 0.1);
}

TEST(PersonCrop, InAStreamTheRotationStaysUnlessThePersonTurns) {
  Doll doll({200, 130}, 40, kWideBox);
  const maq::PersonCrop before = doll.crop(doll.axis());
  EXPECT_LT(degrees_between(before.up(), *doll.axis()), 1e-6);
  const auto lean = [](double degrees) { return Point{std::sin(degrees * kRadians), -std::cos(degrees * kRadians)}; };
  for (const double degrees : {28.0, 52.0}) {
    EXPECT_LT(degrees_between(steady_axis(lean(degrees), before), before.up()), 1e-6);
  }
  EXPECT_LT(degrees_between(steady_axis(std::nullopt, before), before.up()), 1e-6);
  for (const double degrees : {20.0, 60.0}) {
    EXPECT_LT(degrees_between(steady_axis(lean(degrees), before), lean(degrees)), 1e-6);
  }
}

TEST(PersonCrop, InAStreamTheCropStaysWhileThePersonHardlyMoves) {
  Doll doll({200, 130}, 40, kWideBox);
  const maq::PersonCrop before = doll.crop(doll.axis(), 0.05);
  const auto stays = [&](const Point& middle, double lean) {
    Doll moved(middle, lean, kWideBox);
    const maq::PersonCrop wanted = moved.crop(moved.axis(), 0.05);
    const maq::PersonCrop crop = steady_crop(wanted, before, 0.03 * 256);
    const maq::PersonCrop& expected = crop.to_image.shift_x == before.to_image.shift_x ? before : wanted;
    EXPECT_EQ(crop.to_crop.shift_y, expected.to_crop.shift_y);
    EXPECT_EQ(crop.box.x0, expected.box.x0);
    return &expected == &before;
  };
  EXPECT_TRUE(stays({200, 130}, 40));
  EXPECT_TRUE(stays({201, 130.5}, 40));
  EXPECT_FALSE(stays({206, 130}, 40)) << "moved by a twentieth of the height";
  EXPECT_FALSE(stays({200, 130}, 60)) << "turned";
}

TEST(PersonCrop, ASideAtWhichTheBodyHasNoEndGetsNoMargin) {
  Doll whole({200, 130}, 0, kWideBox), cut({200, 130}, 0, {190, 75, 300, 165});  // the torso ends at 180, 220 and 170
  const maq::OpenSides none = open_sides(kCells, 0.5f, whole.memory()), open = open_sides(kCells, 0.5f, cut.memory());
  EXPECT_FALSE(none.left || none.top || none.right || none.bottom);
  EXPECT_TRUE(open.left && open.top && open.bottom);
  EXPECT_FALSE(open.right);
  const Box box = box_in_image(crop_around_person(kCells, cut.map(), std::nullopt, 0.5f, 0.1, 256, cut.memory(), open));
  EXPECT_NEAR(box.x0, 190, 0.1);
  EXPECT_NEAR(box.y0, 75, 0.1);
  EXPECT_NEAR(box.x1, 220 + 0.1 * 90, 2);
  EXPECT_NEAR(box.y1, 165, 0.1);
}

TEST(PersonCrop, TheAxisAndTheBoundsAreFoundInATurnedCropToo) {
  Doll doll({200, 130}, 65, kWideBox);
  const maq::PersonCrop crop = doll.crop(doll.axis());
  // As if the dense head saw the doll through the crop's box: the same cells, elsewhere in the image.
  const maq::AffineMap cells = crop.to_cells(kCells).inverse();
  const Point low = cells({0, 0}), high = cells({0, 64});
  const Point up{(low.x - high.x) / std::hypot(low.x - high.x, low.y - high.y),
                 (low.y - high.y) / std::hypot(low.x - high.x, low.y - high.y)};
  EXPECT_LT(degrees_between(up, {std::sin(65 * kRadians), -std::cos(65 * kRadians)}), 1.5);
  Doll upright({0, 0}, 0, {-60, -70, 60, 50});
  const auto axis = find_body_axis(upright.logits(), cells, 0.5f, upright.memory());
  ASSERT_TRUE(axis);
  EXPECT_LT(degrees_between(*axis, up), 1);
  const Box bounds = person_bounds(kCells, upright.map(), 0.5f, upright.memory());
  EXPECT_NEAR(bounds.x0, -20, 2);
  EXPECT_NEAR(bounds.y0, -65, 2);
  EXPECT_NEAR(bounds.y1, 40, 2);
}

TEST(PersonCrop, ABoxWithoutABodyIsCutAsItIs) {
  Doll outside({1000, 1000}, 0, kWideBox);
  const Box box = box_in_image(outside.crop(std::nullopt));
  EXPECT_NEAR(box.x0, 100, 1e-3);
  EXPECT_NEAR(box.y0, 50, 1e-3);
  EXPECT_NEAR(box.x1, 300, 1e-3);
  EXPECT_NEAR(box.y1, 210, 1e-3);
}

TEST(PersonCrop, ABodyOfOneCellHasACropOfFiniteScale) {
  Doll doll({200, 130}, 0, kWideBox);
  std::fill(doll.memory().odds.begin(), doll.memory().odds.end(), -5.0f);
  doll.memory().odds[10 * kCells + 20] = 5;
  const maq::PersonCrop crop = doll.crop(std::nullopt);
  EXPECT_TRUE(std::isfinite(crop.to_image.xx) && std::isfinite(crop.to_crop.xx));
  EXPECT_GT(crop.box.width(), 0);
  EXPECT_GT(crop.box.height(), 0);
}

}  // namespace
