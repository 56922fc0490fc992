// Ids of people in a stream, with people drawn as rectangles of two colours.
#include "densepose/tracking/person_tracker.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace {

constexpr int kWide = 640, kHigh = 480;
constexpr int64_t kFrameTime = 40'000'000;

struct Colour {
  uint8_t red, green, blue;
};
constexpr Colour kRedShirt{200, 30, 30}, kBlueShirt{30, 40, 200}, kGreenShirt{30, 160, 40}, kDark{40, 40, 45};

struct Walker {
  float x;  // left edge
  Colour shirt, trousers;
  bool is_back = false;
  float y = 100;
};

class PersonTracker : public ::testing::Test {
 protected:
  static constexpr float kSize = 80, kTall = 240;

  // The ids of the people, who are in this order in the frame; those behind are painted first.
  std::vector<int64_t> see(const std::vector<Walker>& people, std::optional<int64_t> time_ns) {
    std::vector<uint8_t> pixels(size_t(width_ * height_) * 3, 90);
    maq::DensePlanes planes;
    planes.reset(width_, height_);
    std::vector<maq::Box> boxes;
    for (size_t n = 0; n < people.size(); ++n) {
      const Walker& walker = people[n];
      boxes.push_back({walker.x, walker.y, walker.x + kSize, walker.y + kTall});
      for (int y = 0; y < height_; ++y) {
        for (int x = 0; x < width_; ++x) {
          const float across = (float(x) - walker.x) / kSize, down = (float(y) - walker.y) / kTall;
          if (across < 0 || across >= 1 || down < 0 || down >= 1) continue;
          const bool is_shirt = down < 0.5f;
          const Colour& colour = is_shirt ? walker.shirt : walker.trousers;
          const size_t pixel = size_t(y * width_ + x);
          const uint8_t front = is_shirt ? 2 : 9, back = is_shirt ? 1 : 7;
          planes.part[pixel] = walker.is_back ? back : front;
          planes.u[pixel] = uint8_t(255 * across);
          planes.v[pixel] = uint8_t(255 * down);
          planes.person[pixel] = uint8_t(n + 1);
          pixels[3 * pixel] = colour.red;
          pixels[3 * pixel + 1] = colour.green;
          pixels[3 * pixel + 2] = colour.blue;
        }
      }
    }
    const maq::ImageView image{MAQ_PIXEL_RGB8, width_, height_, {{pixels.data(), size_t(width_) * 3}, {}}};
    return tracker_.update(image, planes, boxes, time_ns);
  }

  std::vector<int64_t> see(const std::vector<Walker>& people) { return see(people, now_ += kFrameTime); }

  int width_ = kWide, height_ = kHigh;
  int64_t now_ = 0;
  maq::PersonTracker tracker_{20};
};

using Ids = std::vector<int64_t>;

TEST_F(PersonTracker, PeopleKeepTheirIdsInWhateverOrderTheyAreFound) {
  EXPECT_EQ(see({{50, kRedShirt, kDark}, {300, kBlueShirt, kDark}}), (Ids{1, 2}));
  EXPECT_EQ(see({{305, kBlueShirt, kDark}, {55, kRedShirt, kDark}}), (Ids{2, 1}));
  EXPECT_EQ(see({{500, kGreenShirt, kDark}, {310, kBlueShirt, kDark}, {60, kRedShirt, kDark}}), (Ids{3, 2, 1}));
}

TEST_F(PersonTracker, PeopleWhoCrossKeepTheirIdsByTheirColours) {
  for (int frame = 0; frame <= 20; ++frame) {
    const float step = 15 * float(frame);
    // One of them is hidden by the other while both are at the same place.
    if (frame >= 9 && frame <= 11) {
      EXPECT_EQ(see({{150 + step, kRedShirt, kDark}}), (Ids{1})) << frame;
    } else {
      EXPECT_EQ(see({{150 + step, kRedShirt, kDark}, {450 - step, kBlueShirt, kDark}}), (Ids{1, 2})) << frame;
    }
  }
}

TEST_F(PersonTracker, PeopleInEqualClothesWhoCrossKeepTheirIdsByTheirMotion) {
  for (int frame = 0; frame <= 20; ++frame) {
    const float step = 15 * float(frame);
    EXPECT_EQ(see({{150 + step, kRedShirt, kDark, false, 100}, {450 - step, kRedShirt, kDark, false, 110}}),
              (Ids{1, 2}))
        << frame;
  }
}

TEST_F(PersonTracker, SomebodyWhoComesBackIsRecognisedAlsoFromBehind) {
  see({{50, kRedShirt, kDark}, {300, kBlueShirt, kGreenShirt}});
  for (int frame = 0; frame < 100; ++frame) see({{300, kBlueShirt, kGreenShirt}});
  EXPECT_EQ(see({{500, kRedShirt, kDark, true}, {300, kBlueShirt, kGreenShirt}}), (Ids{1, 2}));
}

TEST_F(PersonTracker, SomebodyWhoComesBackInAnotherLightIsRecognisedAfterSomeTime) {
  see({{50, kRedShirt, kDark}, {300, kBlueShirt, kGreenShirt}});
  for (int frame = 0; frame < 100; ++frame) see({{300, kBlueShirt, kGreenShirt}});
  constexpr Colour kShaded{177, 30, 30};
  const auto seen = [&] { return see({{500, kShaded, kDark}, {300, kBlueShirt, kGreenShirt}}); };
  EXPECT_EQ(seen(), (Ids{3, 2}));
  for (int frame = 0; frame < 10; ++frame) EXPECT_EQ(seen(), (Ids{3, 2}));
  for (int frame = 0; frame < 10; ++frame) seen();
  for (int frame = 0; frame < 30; ++frame) EXPECT_EQ(seen(), (Ids{1, 2}));
  EXPECT_EQ(see({{500, kShaded, kDark}, {300, kBlueShirt, kGreenShirt}, {100, kGreenShirt, kRedShirt}}), (Ids{1, 2, 4}))
      << "3 is not used again";
}

TEST_F(PersonTracker, SomebodyWhoIsStillThereIsNotAlsoTheOneWhoComes) {
  for (int frame = 0; frame < 5; ++frame) see({{50, kRedShirt, kDark}});
  for (int frame = 0; frame < 40; ++frame)
    EXPECT_EQ(see({{50, kRedShirt, kDark}, {400, kRedShirt, kDark}}), (Ids{1, 2}));
}

TEST_F(PersonTracker, SomebodyElseAtTheSamePlaceIsNew) {
  see({{50, kRedShirt, kDark}});
  for (int frame = 0; frame < 50; ++frame) see({});
  EXPECT_EQ(see({{50, kGreenShirt, kBlueShirt}}), (Ids{2}));
}

TEST_F(PersonTracker, OfTwoWhoLeftInEqualClothesNobodyIsRecognised) {
  see({{50, kRedShirt, kDark}, {300, kRedShirt, kDark}});
  for (int frame = 0; frame < 50; ++frame) see({});
  EXPECT_EQ(see({{400, kRedShirt, kDark}}), (Ids{3})) << "it may be either, and a wrong id is worse than a new one";
}

TEST_F(PersonTracker, NobodyJumpsThroughTheImageWithinAFrame) {
  see({{20, kRedShirt, kDark}});
  EXPECT_EQ(see({{500, kRedShirt, kDark}}), (Ids{2}));
}

TEST_F(PersonTracker, AnotherStreamAnotherSizeAndOddTimes) {
  EXPECT_EQ(see({{50, kRedShirt, kDark}}, 1000), (Ids{1}));
  EXPECT_EQ(see({{50, kRedShirt, kDark}}, 1000), (Ids{1})) << "the same time";
  EXPECT_EQ(see({{400, kRedShirt, kDark}}, 10), (Ids{1})) << "time went back: by colours";
  EXPECT_EQ(see({{50, kRedShirt, kDark}}, INT64_MAX), (Ids{1}));
  EXPECT_EQ(see({{60, kRedShirt, kDark}}, INT64_MIN), (Ids{1}));
  EXPECT_EQ(see({{60, kRedShirt, kDark}}, std::nullopt), (Ids{1}));
  width_ = 1280;
  EXPECT_EQ(see({{900, kRedShirt, kDark}}), (Ids{1})) << "another camera";
  tracker_.begin_stream();
  EXPECT_EQ(see({{300, kBlueShirt, kDark}, {900, kRedShirt, kDark}}), (Ids{1, 2})) << "nobody is recognised";
  tracker_.begin_stream(tracker_.last_id());
  EXPECT_EQ(see({{900, kRedShirt, kDark}}), (Ids{3}));
}

TEST_F(PersonTracker, FewFramesASecondAndMissingFramesLoseNobody) {
  for (const int64_t time : {kFrameTime, int64_t(400'000'000), int64_t(900'000'000)}) {
    tracker_.begin_stream();
    const Ids first = see({{50, kRedShirt, kDark}, {300, kBlueShirt, kDark}}, 0);
    EXPECT_EQ(see({{80, kRedShirt, kDark}, {330, kBlueShirt, kDark}}, time), first) << time;
  }
}

TEST_F(PersonTracker, CrowdsComeAndGoWithoutEnd) {
  Ids last;
  for (int frame = 0; frame < 30; ++frame) {
    std::vector<Walker> people;
    for (int n = 0; n < 20; ++n) {
      const auto shade = uint8_t(frame * 37 + n * 11);
      people.push_back({float(n * 28), {shade, uint8_t(255 - shade), uint8_t(n * 12)}, kDark});
    }
    const Ids ids = see(people, int64_t(frame) * 3'000'000'000);
    ASSERT_EQ(ids.size(), 20u);
    for (size_t i = 0; i < ids.size(); ++i) {
      EXPECT_GT(ids[i], 0);
      for (size_t k = 0; k < i; ++k) EXPECT_NE(ids[i], ids[k]);
    }
    last = ids;
    EXPECT_TRUE(see({}, int64_t(frame) * 3'000'000'000 + 1).empty());
  }
}

TEST_F(PersonTracker, BoxesWithoutAreaAndPeopleWithoutPixels) {
  const float nan = std::nanf("");
  maq::DensePlanes planes;
  planes.reset(8, 8);
  std::vector<uint8_t> grey(64, 100);
  const maq::ImageView image{MAQ_PIXEL_GREY8, 8, 8, {{grey.data(), 8}, {}}};
  EXPECT_EQ(tracker_.update(image, planes, {{1, 1, 1, 1}, {nan, nan, nan, nan}}, 0), (Ids{1, 2}));
  EXPECT_EQ(tracker_.update(image, planes, {{1, 1, 1, 1}, {nan, nan, nan, nan}}, 1).size(), 2u);
  EXPECT_EQ(tracker_.update(image, planes, {{-1e30f, -1e30f, 1e30f, 1e30f}}, 2).size(), 1u);
}

}  // namespace
