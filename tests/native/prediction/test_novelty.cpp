// How surprising frames are: bits, what is usual, what ends a stream.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "support/expect_error.h"
#include "support/samples/moving_texture.h"
#include "support/samples/tiny_prediction.h"
#include "support/samples/tiny_transformer.h"

namespace {

constexpr int64_t kStep_ns = 33333333;

constexpr const char* kShipped = MAQ_TEST_MODELS "/prediction-int8";

// The shipped networks; one of each for all tests.
std::shared_ptr<maq::FrameEncoder> shipped() {
  static const auto opened = tiny_prediction::encoder(kShipped);
  return opened;
}

std::shared_ptr<maq::CodeTransformer> shipped_transformer() {
  static const auto opened = tiny_transformer::open(kShipped);
  return opened;
}

// A small one, where any will do: emulated, the shipped one takes long.
std::shared_ptr<maq::FrameEncoder> tiny() {
  static const auto opened = tiny_prediction::encoder();
  return opened;
}

maq::Frame texture_frame(double x, int64_t time_ns, int width = 320, int height = 240) {
  return moving_texture::frame(MAQ_PIXEL_BGR8, width, height, x, 0, time_ns);
}

maq::Frame filled_frame(uint8_t value, int64_t time_ns, int width = 320, int height = 240) {
  maq::Frame frame;
  std::memset(frame.allocate_bgr(width, height), value, size_t(width) * size_t(height) * 3);
  frame.timestamp_ns = time_ns;
  return frame;
}

maq::Frame noise_frame(unsigned seed, int64_t time_ns) {
  maq::Frame frame = filled_frame(0, time_ns);
  std::mt19937 random(seed);
  for (uint8_t& value : frame.storage) value = uint8_t(random());
  return frame;
}

// A stream that moves for so many frames that it is known what is usual.
constexpr int kUsual = 12;

int64_t show_motion(maq::Novelty& novelty) {
  for (int i = 0; i < kUsual; ++i) novelty.push(texture_frame(2 * i, i * kStep_ns));
  return kUsual * kStep_ns;
}

TEST(Novelty, BitsEqualPython) {
  maq::Novelty novelty(tiny_prediction::encoder());
  const std::string stored = read_text(tiny_prediction::kFolder + "/bits.f32");
  std::vector<float> expected(stored.size() / sizeof(float));
  std::memcpy(expected.data(), stored.data(), stored.size());
  EXPECT_TRUE(novelty.push(tiny_prediction::frame(0)).is_stream_start);
  for (int number = 1; number < tiny_prediction::kFrames; ++number) {
    const maq::NoveltyScore score = novelty.push(tiny_prediction::frame(number));
    EXPECT_FALSE(score.is_stream_start);
    const float* const of_python = expected.data() + size_t(number - 1) * novelty.map().size();
    for (size_t i = 0; i < novelty.map().size(); ++i) EXPECT_NEAR(novelty.map()[i], of_python[i], 2e-4) << i;
    const float mean = std::accumulate(of_python, of_python + novelty.map().size(), 0.0f) / float(novelty.map().size());
    EXPECT_NEAR(score.bits, mean, 1e-4);
  }
}

TEST(Novelty, WithATransformerBitsEqualTorch) {
  maq::Novelty novelty(tiny_prediction::encoder(tiny_transformer::kBundle), tiny_transformer::open());
  const std::vector<float> expected = tiny_transformer::floats_of("stream.f32");
  for (int again = 0; again < 2; ++again) {
    for (int number = 0; number < tiny_prediction::kFrames; ++number) {
      const maq::NoveltyScore score = novelty.push(tiny_prediction::frame(number));
      EXPECT_EQ(score.is_stream_start, number == 0);
      EXPECT_EQ(novelty.times().transformer_ms > 0, number > 0);
      if (number == 0) continue;
      for (size_t i = 0; i < 256; ++i) {
        ASSERT_NEAR(novelty.map()[i], expected[size_t(number - 1) * 256 + i], 3e-4) << number << " " << i;
      }
    }
  }
}

TEST(Novelty, WithATransformerTheSceneBeforeACutIsNotUsed) {
  const auto transformer = tiny_transformer::open();
  maq::Novelty cut(tiny(), transformer), fresh(tiny(), transformer);
  const int64_t time_ns = show_motion(cut);
  const maq::Frame other = noise_frame(7, time_ns);
  ASSERT_TRUE(cut.push(other).is_cut);
  fresh.push(other);
  for (int i = 1; i < 8; ++i) {
    const auto shown = [&] {
      return moving_texture::frame(MAQ_PIXEL_BGR8, 320, 240, 900 - i, 700, time_ns + i * kStep_ns);
    };
    EXPECT_EQ(cut.push(shown()).bits, fresh.push(shown()).bits) << i;
  }
}

TEST(Novelty, AStreamThatStandsStillHasLessThanATenthOfABitFromTheFifthFrameOn) {
  const auto expect_still = [](const maq::Frame& still, int frames, std::shared_ptr<maq::FrameEncoder> encoder,
                               std::shared_ptr<maq::CodeTransformer> transformer = nullptr) {
    maq::Novelty novelty(std::move(encoder), std::move(transformer));
    for (int i = 0; i < frames; ++i) {
      maq::Frame frame;
      frame.image = still.image;
      frame.timestamp_ns = i * kStep_ns;
      const maq::NoveltyScore score = novelty.push(frame);
      ASSERT_TRUE(std::isfinite(score.bits) && score.bits >= 0);
      ASSERT_TRUE(i < 4 || score.bits <= 0.1f) << i << " " << score.bits;
      ASSERT_TRUE(i < 8 || (score.ratio > 0.4f && score.ratio < 2.5f)) << i << " " << score.ratio;
      ASSERT_FALSE(score.is_cut);
    }
  };
  expect_still(texture_frame(0, 0, 64, 48), 1000, tiny());
  expect_still(texture_frame(0, 0), 20, shipped());
  for (const maq::Frame& still : {filled_frame(0, 0), filled_frame(255, 0), noise_frame(1, 0)}) {
    expect_still(still, 12, shipped());
    expect_still(still, 12, shipped(), shipped_transformer());
  }
  expect_still(texture_frame(0, 0), 12, shipped(), shipped_transformer());
}

TEST(Novelty, CutBlackOutAndFreezeStandOut) {
  maq::Novelty novelty(shipped(), shipped_transformer());
  for (const auto& of_other_scene : {filled_frame(0, kUsual * kStep_ns), noise_frame(3, kUsual * kStep_ns)}) {
    novelty.reset();
    show_motion(novelty);
    maq::Frame frame;
    frame.image = of_other_scene.image;
    frame.timestamp_ns = of_other_scene.timestamp_ns;
    const maq::NoveltyScore score = novelty.push(frame);
    EXPECT_TRUE(score.is_cut);
    EXPECT_FALSE(score.is_stream_start);
    EXPECT_GT(score.ratio, 2);
  }
  novelty.reset();
  const int64_t time_ns = show_motion(novelty);
  float least = 1;
  for (int i = 0; i < 4; ++i) {
    const maq::NoveltyScore score = novelty.push(texture_frame(2 * (kUsual - 1), time_ns + i * kStep_ns));
    least = std::min(least, score.ratio);
    EXPECT_FALSE(score.is_cut);
  }
  EXPECT_LT(least, 0.25) << "freeze";
}

TEST(Novelty, TheSceneBeforeACutIsNotUsed) {
  maq::Novelty cut(shipped()), fresh(shipped());
  const int64_t time_ns = show_motion(cut);
  const auto shown = [&](int i) {
    return moving_texture::frame(MAQ_PIXEL_BGR8, 320, 240, 900 - i, 700, time_ns + i * kStep_ns);
  };
  cut.push(filled_frame(255, time_ns));
  fresh.push(filled_frame(255, time_ns));
  for (int i = 1; i < 12; ++i) {
    const maq::NoveltyScore one = cut.push(shown(i)), other = fresh.push(shown(i));
    EXPECT_EQ(one.bits, other.bits) << i;
    EXPECT_EQ(one.ratio, other.ratio) << i;
  }
}

TEST(Novelty, AnotherSizeOrFormatStandsOutAndStartsAnew) {
  for (int kind = 0; kind < 2; ++kind) {
    maq::Novelty novelty(shipped(), shipped_transformer()), fresh(shipped(), shipped_transformer());
    const int64_t time_ns = show_motion(novelty);
    const auto changed = [&](int i) {
      return kind == 0 ? texture_frame(2 * (kUsual + i), time_ns + i * kStep_ns, 640, 480)
                       : moving_texture::frame(MAQ_PIXEL_NV12, 320, 240, 2 * (kUsual + i), 0, time_ns + i * kStep_ns);
    };
    const maq::NoveltyScore score = novelty.push(changed(0));
    EXPECT_TRUE(score.is_stream_start);
    EXPECT_GT(score.ratio, 2);
    EXPECT_EQ(score.bits, fresh.push(changed(0)).bits);
    for (int i = 1; i < 10; ++i) {
      const maq::NoveltyScore one = novelty.push(changed(i)), other = fresh.push(changed(i));
      EXPECT_EQ(one.bits, other.bits) << i;
      EXPECT_EQ(one.ratio, other.ratio) << i;
      EXPECT_FALSE(one.is_stream_start);
    }
  }
}

TEST(Novelty, TimeThatGoesBackOrPausesStartsAnewWithoutAnEvent) {
  constexpr int64_t kHour_ns = 3600000000000, kMin_ns = std::numeric_limits<int64_t>::min(),
                    kMax_ns = std::numeric_limits<int64_t>::max();
  for (const int64_t jump : {-kStep_ns, kHour_ns, maq::Novelty::kMaxInterval_ns + 1, -kHour_ns}) {
    maq::Novelty novelty(tiny());
    const int64_t last_ns = show_motion(novelty) - kStep_ns;
    const maq::NoveltyScore score = novelty.push(texture_frame(2 * kUsual, last_ns + jump));
    EXPECT_TRUE(score.is_stream_start) << jump;
    EXPECT_EQ(score.ratio, 1) << jump;
  }
  for (const int64_t step : {int64_t(0), maq::Novelty::kMaxInterval_ns}) {
    maq::Novelty novelty(tiny());
    const int64_t last_ns = show_motion(novelty) - kStep_ns;
    EXPECT_FALSE(novelty.push(texture_frame(2 * kUsual, last_ns + step)).is_stream_start) << step;
  }
  maq::Novelty novelty(tiny());
  novelty.push(texture_frame(0, kMin_ns));
  EXPECT_TRUE(novelty.push(texture_frame(0, kMax_ns)).is_stream_start);
  EXPECT_TRUE(novelty.push(texture_frame(0, kMin_ns)).is_stream_start);
  EXPECT_FALSE(novelty.push(texture_frame(0, kMin_ns)).is_stream_start);
  maq::Frame of_other_clock = texture_frame(0, kMin_ns);
  of_other_clock.clock = MAQ_CLOCK_MONOTONIC;
  EXPECT_TRUE(novelty.push(of_other_clock).is_stream_start);
}

TEST(Novelty, WithFewFramesTheRatioIsOne) {
  maq::Novelty novelty(shipped());
  EXPECT_TRUE(novelty.map().empty());
  const maq::NoveltyScore first = novelty.push(texture_frame(0, 0));
  EXPECT_TRUE(first.is_stream_start);
  EXPECT_EQ(first.ratio, 1);
  EXPECT_GT(first.bits, 5) << "by how rare codes are";
  EXPECT_EQ(novelty.map().size(), 256u);
  for (int i = 1; i <= int(maq::Novelty::kMinBefore); ++i) {
    EXPECT_EQ(novelty.push(texture_frame(i * i, i * kStep_ns)).ratio, 1) << i;
  }
  EXPECT_LT(novelty.push(texture_frame(16, 5 * kStep_ns)).ratio, 1);
}

TEST(Novelty, TheMapShowsTheChangeAndItsMeanIsTheScore) {
  maq::Novelty novelty(shipped());
  for (int i = 0; i < 12; ++i) novelty.push(texture_frame(0, i * kStep_ns));
  maq::Frame changed = texture_frame(0, 12 * kStep_ns);
  for (int y = 120; y < 180; ++y) std::memset(changed.storage.data() + size_t(y) * 960 + 480, 255, 240);
  const maq::NoveltyScore score = novelty.push(changed);
  const std::vector<float>& map = novelty.map();
  const double mean = std::accumulate(map.begin(), map.end(), 0.0) / double(map.size());
  EXPECT_NEAR(mean, double(score.bits), 1e-4);
  const auto peak = size_t(std::max_element(map.begin(), map.end()) - map.begin());
  EXPECT_TRUE(peak / 16 >= 7 && peak / 16 <= 12 && peak % 16 >= 7 && peak % 16 <= 12) << peak;
  EXPECT_LT(map[0], 0.3) << "nothing changed there";
  EXPECT_LT(map[255], 0.3);
}

TEST(Novelty, AFrameThatCannotBeEncodedLeavesTheStreamAsItWas) {
  maq::Novelty novelty(tiny()), other(tiny());
  const int64_t time_ns = show_motion(novelty);
  show_motion(other);
  const std::vector<float> map = novelty.map();
  maq::Frame depth;
  depth.allocate(MAQ_PIXEL_DEPTH16, 320, 240);
  expect_error(MAQ_ERROR_UNSUPPORTED, "depth", [&] { novelty.push(depth); });
  EXPECT_EQ(novelty.map(), map);
  const maq::NoveltyScore one = novelty.push(texture_frame(2 * kUsual, time_ns)),
                          two = other.push(texture_frame(2 * kUsual, time_ns));
  EXPECT_EQ(one.bits, two.bits);
  EXPECT_EQ(one.ratio, two.ratio);
}

}  // namespace
