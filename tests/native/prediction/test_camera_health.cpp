// Camera health: events of made streams, what ends a stream, pictures of any kind.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "prediction/health/camera_health.h"
#include "support/expect_error.h"
#include "support/samples/moving_texture.h"

namespace {

using maq::CameraEvent;

constexpr int64_t kHealthStep_ns = 33333333;
constexpr int kCalmFrames = 12;

// A grey picture of blots in which no part is like another, larger than a frame.
class Scene {
 public:
  static constexpr int kSide_px = 900, kBlot_px = 12;

  explicit Scene(unsigned seed) : values_(size_t(kSide_px) * kSide_px) {
    constexpr int kBlots = kSide_px / kBlot_px + 2;
    std::mt19937 random(seed);
    std::vector<float> blots(size_t(kBlots) * kBlots);
    for (float& blot : blots) blot = float(random() % 200 + 30);
    for (int y = 0; y < kSide_px; ++y) {
      for (int x = 0; x < kSide_px; ++x) {
        const float right = float(x % kBlot_px) / kBlot_px, below = float(y % kBlot_px) / kBlot_px;
        const float* const at = blots.data() + size_t(y / kBlot_px) * kBlots + size_t(x / kBlot_px);
        const float upper = at[0] * (1 - right) + at[1] * right;
        const float lower = at[kBlots] * (1 - right) + at[kBlots + 1] * right;
        values_[size_t(y) * kSide_px + size_t(x)] = uint8_t(upper * (1 - below) + lower * below);
      }
    }
  }
  // The view of a camera whose picture moved by (x, y).
  maq::Frame seen(int x, int y) const {
    maq::Frame frame;
    uint8_t* pixels = frame.allocate_bgr(320, 240);
    for (int row = 0; row < 240; ++row) {
      for (int column = 0; column < 320; ++column, pixels += 3) {
        const size_t at = size_t(row - y + 330) * kSide_px + size_t(column - x + 290);
        std::fill_n(pixels, 3, values_[at]);
      }
    }
    return frame;
  }

 private:
  std::vector<uint8_t> values_;
};

const Scene& scene(unsigned number) {
  static const Scene scenes[] = {Scene(1), Scene(2), Scene(3), Scene(4)};
  return scenes[number % 4];
}

// A stream whose frames are made by a function of their number; what was found with each.
class HealthStream {
 public:
  maq::HealthResult push(maq::Frame frame) {
    frame.timestamp_ns = next_ns_;
    next_ns_ += kHealthStep_ns;
    found_.push_back(health_.push(frame));
    return found_.back();
  }
  // A scene at (x, y) with a little noise, as of a sensor.
  maq::HealthResult show(int x, int y = 0, unsigned number = 0) { return push(noisy(x, y, number)); }
  maq::Frame noisy(int x, int y = 0, unsigned number = 0) {
    maq::Frame frame = scene(number).seen(x, y);
    for (uint8_t& value : frame.storage) value = uint8_t(std::clamp(int(value) + int(random_() % 3) - 1, 0, 255));
    return frame;
  }
  void be_calm() {
    for (int i = 0; i < kCalmFrames; ++i) ASSERT_EQ(show(0).event, CameraEvent::kNone) << i;
  }
  // The events of the frames since the last call.
  std::vector<CameraEvent> events() {
    std::vector<CameraEvent> kinds;
    for (; seen_ < found_.size(); ++seen_) {
      if (found_[seen_].event != CameraEvent::kNone) kinds.push_back(found_[seen_].event);
    }
    return kinds;
  }
  const maq::HealthResult& last_event() const {
    return *std::find_if(found_.rbegin(), found_.rend(), [](const auto& of) { return of.event != CameraEvent::kNone; });
  }
  int64_t next_ns() const { return next_ns_; }
  void set_next_ns(int64_t time_ns) { next_ns_ = time_ns; }
  maq::CameraHealth& health() { return health_; }

 private:
  maq::CameraHealth health_;
  std::vector<maq::HealthResult> found_;
  std::mt19937 random_{5};
  size_t seen_ = 0;
  int64_t next_ns_ = 0;
};

maq::Frame plain(uint8_t value, int width = 320, int height = 240) {
  maq::Frame frame;
  std::memset(frame.allocate_bgr(width, height), value, size_t(width) * size_t(height) * 3);
  return frame;
}

maq::Frame noise(unsigned seed) {
  maq::Frame frame = plain(0);
  std::mt19937 random(seed);
  for (uint8_t& value : frame.storage) value = uint8_t(random());
  return frame;
}

void fill(maq::Frame& frame, int left, int top, int right, int bottom, uint8_t value) {
  for (int y = top; y < bottom; ++y) {
    std::memset(frame.storage.data() + (size_t(y) * 320 + size_t(left)) * 3, value, size_t(right - left) * 3);
  }
}

using Kinds = std::vector<CameraEvent>;

TEST(CameraHealth, AStreamThatMovesEvenlyHasNoEvents) {
  HealthStream stream;
  for (int i = 0; i < 40; ++i) stream.show(3 * i, i % 3);
  EXPECT_EQ(stream.events(), Kinds{});
}

TEST(CameraHealth, AnotherSceneIsACutOneFrameLater) {
  HealthStream stream;
  stream.be_calm();
  const int64_t cut_ns = stream.next_ns();
  EXPECT_EQ(stream.show(0, 0, 1).event, CameraEvent::kNone) << "it could be a flash";
  EXPECT_EQ(stream.show(0, 0, 1).event, CameraEvent::kCut);
  EXPECT_EQ(stream.last_event().began_ns, cut_ns);
  for (int i = 0; i < 5; ++i) stream.show(0, 0, 1);
  EXPECT_EQ(stream.events(), Kinds{CameraEvent::kCut}) << "and nothing else";
}

TEST(CameraHealth, OneOtherFrameIsNoCut) {
  HealthStream stream;
  stream.be_calm();
  stream.push(noise(3));
  for (int i = 0; i < 5; ++i) stream.show(0);
  EXPECT_EQ(stream.events(), Kinds{});
}

TEST(CameraHealth, AHandThatTurnsQuicklyMakesNoCuts) {
  HealthStream stream;
  stream.be_calm();
  // So far from frame to frame that nothing of a frame is in the next.
  for (unsigned i = 1; i < 40; ++i) stream.show(0, 0, i);
  EXPECT_EQ(stream.events(), Kinds{});
}

TEST(CameraHealth, EqualFramesForATimeAreAFreezeUntilOneDiffers) {
  // By times, and without usable ones by frames.
  for (const int64_t step_ns : {int64_t(100000000), int64_t(0)}) {
    HealthStream stream;
    stream.be_calm();
    const maq::Frame frozen = stream.noisy(0);
    const int64_t first_ns = stream.next_ns();
    int equal = 0;
    maq::HealthResult result;
    while (equal < 20 && result.event == CameraEvent::kNone) {
      maq::Frame frame;
      frame.image = frozen.image;
      stream.set_next_ns(first_ns + step_ns * equal++);
      result = stream.push(std::move(frame));
    }
    EXPECT_EQ(result.event, CameraEvent::kFreeze);
    EXPECT_EQ(equal, step_ns > 0 ? 4 : 10) << "some equal frames come in compressed films of a still scene";
    EXPECT_EQ(result.state, CameraEvent::kFreeze);
    EXPECT_EQ(result.began_ns, first_ns);
    EXPECT_EQ(stream.show(0).state, CameraEvent::kNone);
    stream.be_calm();
    EXPECT_EQ(stream.events(), Kinds{CameraEvent::kFreeze});
  }
}

TEST(CameraHealth, ABlackPictureIsSaidAtOnceAlsoInTheFirstFrame) {
  for (const int before : {0, kCalmFrames}) {
    HealthStream stream;
    for (int i = 0; i < before; ++i) stream.show(0);
    EXPECT_EQ(stream.push(plain(7)).event, CameraEvent::kBlack) << before;
    EXPECT_EQ(stream.push(plain(7)).event, CameraEvent::kNone);
    EXPECT_EQ(stream.push(plain(6)).state, CameraEvent::kBlack);
    EXPECT_EQ(stream.show(0).state, CameraEvent::kNone);
    stream.be_calm();
    EXPECT_EQ(stream.events(), Kinds{CameraEvent::kBlack});
  }
}

TEST(CameraHealth, AHandBeforeTheLensCoversIt) {
  HealthStream stream;
  stream.be_calm();
  const auto covered = [&](int width) {
    maq::Frame frame = stream.noisy(0);
    fill(frame, 0, 0, width, 240, 70);
    return stream.push(std::move(frame));
  };
  for (const int width : {60, 120, 180, 230}) covered(width);
  for (int i = 0; i < 6; ++i) covered(250);
  EXPECT_EQ(stream.events(), Kinds{CameraEvent::kCovered});
  EXPECT_EQ(covered(250).state, CameraEvent::kCovered);
  stream.show(0);
  EXPECT_EQ(stream.show(0).state, CameraEvent::kNone);
}

TEST(CameraHealth, AKnockMovesThePictureByWhatIsSaid) {
  HealthStream stream;
  stream.be_calm();
  stream.show(40, -20);
  for (int i = 0; i < 5; ++i) stream.show(40, -20);
  EXPECT_EQ(stream.events(), Kinds{CameraEvent::kMoved});
  EXPECT_NEAR(stream.last_event().shift_x, 40.0 / 320, 0.01);
  EXPECT_NEAR(stream.last_event().shift_y, -20.0 / 320, 0.01);
}

TEST(CameraHealth, SomethingThatIsThereAtOnceIsAnObjectAtItsPlace) {
  HealthStream stream;
  stream.be_calm();
  std::mt19937 random(9);
  std::vector<uint8_t> stripes(60 * 50);
  for (int y = 0; y < 50; ++y) {
    for (int x = 0; x < 60; ++x) stripes[size_t(y * 60 + x)] = (x / 8 + y / 8) % 2 == 0 ? 20 : 230;
  }
  for (int i = 0; i < 6; ++i) {
    maq::Frame frame = stream.noisy(0);
    for (int y = 0; y < 50; ++y) {
      for (int x = 0; x < 60; ++x) {
        fill(frame, 200 + x, 100 + y, 201 + x, 101 + y, stripes[size_t(y * 60 + x)]);
      }
    }
    stream.push(std::move(frame));
  }
  EXPECT_EQ(stream.events(), Kinds{CameraEvent::kObject});
  EXPECT_NEAR(stream.last_event().object_x, 230.0 / 320, 0.05);
  EXPECT_NEAR(stream.last_event().object_y, 125.0 / 240, 0.05);
}

TEST(CameraHealth, LightThatChangesEverywhereIsNoEvent) {
  HealthStream stream;
  stream.be_calm();
  for (int i = 0; i < 12; ++i) {
    maq::Frame frame = stream.noisy(0);
    for (uint8_t& value : frame.storage) value = uint8_t(value * 3 / 4 + 10);
    stream.push(std::move(frame));
  }
  EXPECT_EQ(stream.events(), Kinds{});
}

TEST(CameraHealth, NoiseAloneIsNoEvent) {
  HealthStream stream;
  for (unsigned i = 0; i < 30; ++i) stream.push(noise(i));
  EXPECT_EQ(stream.events(), Kinds{});
}

TEST(CameraHealth, AnotherSizeFormatClockOrTimeStartsAnew) {
  constexpr int64_t kMin_ns = std::numeric_limits<int64_t>::min(), kMax_ns = std::numeric_limits<int64_t>::max();
  HealthStream stream;
  EXPECT_TRUE(stream.show(0).is_stream_start);
  EXPECT_FALSE(stream.show(0).is_stream_start);
  EXPECT_TRUE(stream.push(plain(90, 64, 48)).is_stream_start);
  EXPECT_FALSE(stream.push(plain(90, 64, 48)).is_stream_start);
  EXPECT_TRUE(stream.push(moving_texture::frame(MAQ_PIXEL_NV12, 64, 48, 0, 0)).is_stream_start);
  maq::Frame of_other_clock = moving_texture::frame(MAQ_PIXEL_NV12, 64, 48, 0, 0);
  of_other_clock.clock = MAQ_CLOCK_MONOTONIC;
  EXPECT_TRUE(stream.push(std::move(of_other_clock)).is_stream_start);
  EXPECT_TRUE(stream.show(0).is_stream_start);
  stream.set_next_ns(stream.next_ns() - 2 * kHealthStep_ns);
  EXPECT_TRUE(stream.show(0).is_stream_start) << "an earlier time";
  stream.set_next_ns(stream.next_ns() + maq::CameraHealth::kMaxInterval_ns);
  EXPECT_TRUE(stream.show(0).is_stream_start) << "a pause";
  stream.health().reset();
  EXPECT_TRUE(stream.show(0).is_stream_start);
  EXPECT_EQ(stream.events(), Kinds{});
  for (const int64_t time_ns : {kMin_ns, kMax_ns - kHealthStep_ns, kMin_ns}) {
    stream.set_next_ns(time_ns);
    EXPECT_TRUE(stream.show(0).is_stream_start) << time_ns;
  }
}

TEST(CameraHealth, FramesOfOneTimeGoOn) {
  HealthStream stream;
  for (int i = 0; i < 12; ++i) {
    stream.set_next_ns(7);
    EXPECT_EQ(stream.show(2 * i).is_stream_start, i == 0);
  }
  EXPECT_EQ(stream.events(), Kinds{});
}

TEST(CameraHealth, FramesOfAnySizeAreCheckedSmallOnesForFreezeAndBlackAlone) {
  for (const auto& [width, height] : {std::pair{1, 1}, {3000, 1}, {1, 3000}, {7, 9}, {31, 200}, {200, 17}, {33, 33}}) {
    HealthStream stream;
    for (int i = 0; i < 3; ++i) {
      const maq::HealthResult result = stream.push(moving_texture::frame(MAQ_PIXEL_GREY8, width, height, i, 0));
      EXPECT_TRUE(result.unexplained >= 0 && result.unexplained <= 1) << width << " " << height;
    }
    for (const float value : stream.health().match().unexplained()) EXPECT_TRUE(value >= 0 && value <= 1);
    for (int i = 0; i < 3; ++i) stream.push(plain(200, width, height));
    stream.push(plain(0, width, height));
    EXPECT_EQ(stream.last_event().event, CameraEvent::kBlack) << width << " " << height;
  }
}

TEST(CameraHealth, ADepthImageIsRefusedAndLeavesTheStreamAsItWas) {
  HealthStream stream;
  stream.be_calm();
  maq::Frame depth;
  depth.allocate(MAQ_PIXEL_DEPTH16, 320, 240);
  expect_error(MAQ_ERROR_UNSUPPORTED, "depth", [&] { stream.health().push(depth); });
  EXPECT_FALSE(stream.show(0).is_stream_start);
  EXPECT_EQ(stream.events(), Kinds{});
}

}  // namespace
