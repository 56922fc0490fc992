// Frames in, coming frames out: where things will be, and what ends a context.
#include "prediction/blend/motion_predictor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>
#include <thread>

#include "support/expect_error.h"
#include "support/peak_memory.h"
#include "support/samples/moving_texture.h"

namespace {

using moving_texture::worst_error_px;

constexpr int kWidth = 320, kHeight = 240;
constexpr int64_t kFrame_ns = 33333333;

maq::Frame texture(double x, double y, int64_t time_ns) {
  return moving_texture::frame(MAQ_PIXEL_GREY8, kWidth, kHeight, x, y, time_ns);
}

maq::Frame plain(int width, int height, uint8_t value, int64_t time_ns, maq_pixel_format format = MAQ_PIXEL_GREY8) {
  maq::Frame frame;
  std::memset(frame.allocate(format, width, height), value, maq::packed_bytes(format, width, height));
  frame.timestamp_ns = time_ns;
  return frame;
}

maq::Frame noise(int width, int height, unsigned seed, int64_t time_ns) {
  maq::Frame frame = plain(width, height, 0, time_ns);
  std::mt19937 random(seed);
  for (uint8_t& value : frame.storage) value = uint8_t(random());
  return frame;
}

std::vector<uint8_t> pixels_of(const maq::Frame& frame) {
  std::vector<uint8_t> pixels(maq::packed_bytes(frame.image.format, frame.image.width_px, frame.image.height_px));
  maq::copy_packed(frame.image, pixels.data());
  return pixels;
}

void expect_last(maq::MotionPredictor& predictor, const maq::Frame& last, int64_t ahead_ns = 5 * kFrame_ns) {
  maq::Frame predicted;
  predictor.predict(ahead_ns, predicted);
  EXPECT_EQ(pixels_of(predicted), pixels_of(last));
  EXPECT_EQ(predictor.stats().method, maq::PredictionMethod::kLast);
}

TEST(MotionPredictor, WhatMovesByOneOrAQuarterPixelAFrameIsWithinAQuarterPixelFiveFramesAhead) {
  for (const auto& [dx, dy] : {std::pair{1.0, 0.0}, {0.25, 0.0}, {0.0, -0.25}, {-0.7, 0.7}, {6.0, 4.0}}) {
    for (const maq::PredictionMethod method : {maq::PredictionMethod::kMotion, maq::PredictionMethod::kAuto}) {
      maq::MotionPredictor predictor({method, 1});
      const int count = method == maq::PredictionMethod::kAuto ? 8 : 2;  // until it is known which method is right
      for (int i = 0; i < count; ++i) predictor.push(texture(dx * i, dy * i, i * kFrame_ns));
      maq::Frame predicted;
      predictor.predict(5 * kFrame_ns, predicted);
      EXPECT_GT(predictor.stats().motion_fraction, 0.8f) << dx << " " << dy;
      // The texture that comes in over the edges is not known.
      const int margin = 16 + int(6 * std::max(std::abs(dx), std::abs(dy)));
      EXPECT_LE(worst_error_px(predicted, dx * (count + 4), dy * (count + 4), margin), 0.25) << dx << " " << dy;
      EXPECT_EQ(predicted.timestamp_ns, (count + 4) * kFrame_ns);
      EXPECT_TRUE(predicted.origin.is_predicted);
      EXPECT_EQ(predicted.origin.horizon_ns, 5 * kFrame_ns);
      EXPECT_EQ(predicted.origin.captured_timestamp_ns, (count - 1) * kFrame_ns);
    }
  }
}

TEST(MotionPredictor, TimeCountsAndNotTheNumberOfFrames) {
  maq::MotionPredictor predictor({maq::PredictionMethod::kMotion, 1});
  double at = 0;
  for (const int frame : {0, 1, 2, 4, 5, 8, 9, 11}) {  // of 30 a second; the others were lost
    at = 0.5 * frame;
    predictor.push(texture(at, 0, frame * kFrame_ns));
  }
  for (const double frames : {0.5, 1.0, 2.5, 6.0}) {
    maq::Frame predicted;
    predictor.predict(int64_t(frames * kFrame_ns), predicted);
    EXPECT_LE(worst_error_px(predicted, at + 0.5 * frames, 0, 20), 0.25) << frames;
  }
}

TEST(MotionPredictor, EveryFormatKeepsItsColoursTogether) {
  for (const maq_pixel_format format :
       {MAQ_PIXEL_GREY8, MAQ_PIXEL_BGR8, MAQ_PIXEL_RGB8, MAQ_PIXEL_RGBA8, MAQ_PIXEL_NV12, MAQ_PIXEL_YUYV}) {
    for (const auto& [width, height] : {std::pair{320, 240}, {641, 479}}) {
      const auto frame = [&, w = width, h = height](int i) {
        return moving_texture::frame(format, w, h, 2 * i, i, i * kFrame_ns);
      };
      maq::MotionPredictor predictor({maq::PredictionMethod::kMotion, 2});
      predictor.push(frame(0));
      predictor.push(frame(1));
      maq::Frame predicted;
      predictor.predict(2 * kFrame_ns, predicted);
      const maq::Frame truth = frame(3);
      ASSERT_EQ(predicted.image.format, format);
      const int plane_count = maq::plane_count(format);
      for (int plane = 0; plane < plane_count; ++plane) {
        const size_t bytes = maq::row_bytes(format, plane, width / 2 * 2);
        double sum = 0;
        size_t count = 0;
        const int rows = maq::plane_rows(format, plane, height);
        for (int row = 20; row < rows - 20; ++row) {
          const auto row_of = [&](const maq::Frame& of) {
            return of.image.planes[plane].data + size_t(row) * of.image.planes[plane].stride_bytes;
          };
          for (size_t i = 80; i + 80 < bytes; ++i, ++count) {
            const int difference = row_of(predicted)[i] - row_of(truth)[i];
            sum += difference * difference;
          }
        }
        EXPECT_LT(std::sqrt(sum / double(count)), 4) << maq::pixel_format_name(format) << " plane " << plane;
      }
    }
  }
}

// A bright square moves over a texture that stands still.
TEST(MotionPredictor, AThingThatMovesIsWhereItWillBeAndTheRestStandsStill) {
  const auto scene = [](int i) {
    maq::Frame frame = texture(0, 0, i * kFrame_ns);
    for (int y = 100; y < 148; ++y) {
      for (int x = 60 + 4 * i; x < 108 + 4 * i; ++x) {
        frame.storage[size_t(y * kWidth + x)] = uint8_t(150 + 40 * std::sin(0.5 * (x - 4 * i)) * std::sin(0.4 * y));
      }
    }
    return frame;
  };
  maq::MotionPredictor predictor({maq::PredictionMethod::kMotion, 1});
  predictor.push(scene(0));
  predictor.push(scene(1));
  maq::Frame predicted;
  predictor.predict(6 * kFrame_ns, predicted);
  const auto difference = [&](const maq::Frame& truth, int left, int right, int top, int bottom) {
    double sum = 0;
    for (int y = top; y < bottom; ++y) {
      for (int x = left; x < right; ++x) {
        const size_t at = size_t(y * kWidth + x);
        sum += std::abs(predicted.image.planes[0].data[at] - truth.image.planes[0].data[at]);
      }
    }
    return sum / ((right - left) * (bottom - top));
  };
  const maq::Frame truth = scene(7), last = scene(1);
  EXPECT_LT(difference(truth, 60 + 28 + 4, 108 + 28 - 4, 104, 144), 4) << "to its leading edge, without holes";
  EXPECT_GT(difference(last, 60 + 28 + 4, 108 + 28 - 4, 104, 144), 15);
  EXPECT_EQ(difference(last, 0, kWidth, 0, 80), 0) << "above";
  EXPECT_EQ(difference(last, 180, kWidth, 0, kHeight), 0) << "to the right";
}

TEST(MotionPredictor, WhileNothingMovesItIsTheLastFrame) {
  std::mt19937 random(3);
  std::normal_distribution<double> grain(0, 2);
  for (const maq::PredictionMethod method : {maq::PredictionMethod::kAuto, maq::PredictionMethod::kMotion}) {
    for (const bool has_grain : {false, true}) {
      maq::MotionPredictor predictor({method, 1});
      maq::Frame last;
      for (int i = 0; i < 20; ++i) {
        last = texture(0, 0, i * kFrame_ns);
        for (uint8_t& value : last.storage) {
          if (has_grain) value = uint8_t(std::clamp(value + grain(random), 0.0, 255.0));
        }
        predictor.push(last);
      }
      expect_last(predictor, last);
      expect_last(predictor, last, 100 * kFrame_ns);
    }
  }
}

TEST(MotionPredictor, AFrameThatRepeatsTheLastKeepsItsMotionAndTheNextOneStandsStill) {
  maq::MotionPredictor predictor({maq::PredictionMethod::kMotion, 1});
  const auto push = [&](double x, int number) {
    predictor.push(moving_texture::frame(MAQ_PIXEL_GREY8, 320, 240, x, 0, number * 33333333));
  };
  for (int i = 0; i < 6; ++i) push(2 * i, i);
  push(10, 6);  // the frame of 12 is missing
  maq::Frame later;
  predictor.predict(33333333, later);
  EXPECT_EQ(later.timestamp_ns, 7 * 33333333);
  EXPECT_EQ(later.origin.captured_timestamp_ns, 6 * 33333333);
  EXPECT_LT(moving_texture::worst_error_px(later, 14, 0, 20), 0.3) << "it goes on as if the frame had come";
  push(14, 7);
  predictor.predict(33333333, later);
  EXPECT_LT(moving_texture::worst_error_px(later, 16, 0, 20), 0.3);
  push(14, 8);
  push(14, 9);
  predictor.predict(66666667, later);
  EXPECT_LT(moving_texture::worst_error_px(later, 14, 0, 20), 0.05) << "two repeats stand still";
}

TEST(MotionPredictor, AutoIsTheMethodThatWasRight) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(-3, 3);
  const auto texture = [](double x, double y, int64_t at_ns) {
    return moving_texture::frame(MAQ_PIXEL_GREY8, 160, 120, x, y, at_ns);
  };
  maq::MotionPredictor predictor({maq::PredictionMethod::kAuto, 1});
  maq::Frame predicted;
  int64_t time_ns = 0;
  const auto motion_fraction = [&](int frames) {
    predictor.predict(frames * kFrame_ns, predicted);
    return predictor.stats().motion_fraction;
  };
  for (int i = 0; i < 30; ++i) predictor.push(texture(anywhere(random), anywhere(random), time_ns += kFrame_ns));
  for (const int frames : {1, 2, 4, 8, 16}) {
    EXPECT_LT(motion_fraction(frames), 0.3f) << "a camera that shakes, " << frames;
  }
  for (int i = 0; i < 40; ++i) predictor.push(texture(0.5 * i, 0, time_ns += kFrame_ns));
  for (const int frames : {1, 2, 4, 8, 16}) {
    EXPECT_GT(motion_fraction(frames), 0.8f) << "and then moves on evenly, " << frames;
  }
  // There and back within 8 frames: right for the next frames, wrong for those farther ahead.
  for (int i = 0; i < 160; ++i) predictor.push(texture(6 * std::sin(i * 0.785), 0, time_ns += kFrame_ns));
  EXPECT_LT(motion_fraction(8), 0.1f);
}

// On the left all moves on evenly, on the right there and back.
TEST(MotionPredictor, AutoTakesTheMethodThatWasRightInEachPlace) {
  constexpr int kSide = 256, kFrames = 40, kAhead = 8;
  const auto halves = [](int number) {
    maq::Frame frame = moving_texture::frame(MAQ_PIXEL_GREY8, kSide, kSide, 0.5 * number, 0, number * kFrame_ns);
    const maq::Frame right =
        moving_texture::frame(MAQ_PIXEL_GREY8, kSide, kSide, 0, 6 * std::sin(number * 0.785), number * kFrame_ns);
    for (int y = 0; y < kSide; ++y) {
      const ptrdiff_t row = y * kSide;
      std::copy(right.storage.begin() + row + kSide / 2, right.storage.begin() + row + kSide,
                frame.storage.begin() + row + kSide / 2);
    }
    return frame;
  };
  const std::vector<uint8_t> truth = pixels_of(halves(kFrames - 1 + kAhead));
  const auto prediction_of = [&](maq::PredictionMethod method) {
    maq::MotionPredictor predictor({method, 2});
    for (int i = 0; i < kFrames; ++i) predictor.push(halves(i));
    maq::Frame predicted;
    predictor.predict(kAhead * kFrame_ns, predicted);
    return pixels_of(predicted);
  };
  const std::vector<uint8_t> by_last = prediction_of(maq::PredictionMethod::kLast),
                             by_motion = prediction_of(maq::PredictionMethod::kMotion),
                             by_auto = prediction_of(maq::PredictionMethod::kAuto);
  const auto error_of = [&](const std::vector<uint8_t>& pixels, int left) {
    double sum = 0;
    for (int y = 40; y < kSide - 40; ++y) {
      for (int x = left; x < left + kSide / 4; ++x) {
        const size_t at = size_t(y * kSide + x);
        sum += std::abs(int(pixels[at]) - int(truth[at]));
      }
    }
    return sum / ((kSide - 80) * kSide / 4);
  };
  for (const auto& [left, right, wrong] :
       {std::tuple{24, &by_motion, &by_last}, std::tuple{168, &by_last, &by_motion}}) {
    const double best = error_of(*right, left), worst = error_of(*wrong, left);
    EXPECT_LT(error_of(by_auto, left), best + 0.15 * (worst - best)) << left;
  }
}

TEST(MotionPredictor, EveryPictureHasAMotionThatIsANumber) {
  const auto checkerboard = [](int phase, int64_t time_ns) {
    maq::Frame frame = plain(kWidth, kHeight, 0, time_ns);
    for (size_t i = 0; i < frame.storage.size(); ++i) {
      frame.storage[i] = uint8_t((i % kWidth + i / kWidth + size_t(phase)) % 2 * 255);
    }
    return frame;
  };
  maq::WorkerThreads threads(1);
  maq::OpticalFlow optical_flow;
  const std::vector<maq::Frame> all = [&] {
    std::vector<maq::Frame> made;
    made.push_back(plain(kWidth, kHeight, 0, 0));
    made.push_back(plain(kWidth, kHeight, 255, 0));
    made.push_back(plain(kWidth, kHeight, 77, 0));
    made.push_back(noise(kWidth, kHeight, 1, 0));
    made.push_back(noise(kWidth, kHeight, 2, 0));
    made.push_back(checkerboard(0, 0));
    made.push_back(checkerboard(1, 0));
    made.push_back(texture(0, 0, 0));
    return made;
  }();
  for (const maq::Frame& one : all) {
    for (const maq::Frame& other : all) {
      maq::LumaPyramid from, to;
      from.set(one.image, threads);
      to.set(other.image, threads);
      maq::FlowField flow;
      const maq::FlowFit fit = optical_flow.find(from, to, threads, flow);
      EXPECT_TRUE(std::isfinite(fit.contrast) && std::isfinite(fit.still) && std::isfinite(fit.moved));
      for (size_t i = 0; i < flow.dx_px.size(); ++i) {
        ASSERT_TRUE(std::abs(flow.dx_px[i]) < kWidth && std::abs(flow.dy_px[i]) < kWidth) << i;
      }
    }
  }
  for (const uint8_t value : {uint8_t(0), uint8_t(77), uint8_t(255)}) {
    maq::MotionPredictor predictor({maq::PredictionMethod::kMotion, 1});
    for (int i = 0; i < 3; ++i) predictor.push(plain(kWidth, kHeight, value, i * kFrame_ns));
    expect_last(predictor, plain(kWidth, kHeight, value, 0));
  }
}

TEST(MotionPredictor, EverySizeIsPredicted) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {7, 5}, {8, 8}, {16, 16}, {31, 33}, {1, 4000}, {4000, 1}, {4096, 9}}) {
    for (const maq_pixel_format format : {MAQ_PIXEL_BGR8, MAQ_PIXEL_NV12, MAQ_PIXEL_YUYV}) {
      maq::MotionPredictor predictor({maq::PredictionMethod::kMotion, 2});
      maq::Frame predicted;
      for (int i = 0; i < 3; ++i) {
        predictor.push(moving_texture::frame(format, width, height, i, 0, i * kFrame_ns));
        predictor.predict(kFrame_ns, predicted);
        EXPECT_EQ(predicted.image.width_px, width);
        EXPECT_EQ(predicted.image.height_px, height);
      }
    }
  }
}

TEST(MotionPredictor, PredictorsThatTakeTurnsInOneMemoryPredictAsThoseAlone) {
  const auto shared = std::make_shared<maq::MotionWorkspaces>();
  struct Stream {
    int width, height;
    maq::MotionPredictor turn, alone;
  };
  Stream streams[] = {{kWidth, kHeight, maq::MotionPredictor({maq::PredictionMethod::kAuto, 1, shared}),
                       maq::MotionPredictor({maq::PredictionMethod::kAuto, 1})},
                      {96, 64, maq::MotionPredictor({maq::PredictionMethod::kMotion, 2, shared}),
                       maq::MotionPredictor({maq::PredictionMethod::kMotion, 1})},
                      {24, 700, maq::MotionPredictor({maq::PredictionMethod::kAuto, 1, shared}),
                       maq::MotionPredictor({maq::PredictionMethod::kAuto, 1})}};
  maq::Frame turn, alone;
  for (int i = 0; i < 8; ++i) {
    for (Stream& stream : streams) {
      const maq::Frame frame =
          moving_texture::frame(MAQ_PIXEL_NV12, stream.width, stream.height, 1.5 * i, -0.5 * i, i * kFrame_ns);
      stream.turn.push(frame);
      stream.alone.push(frame);
    }
    for (Stream& stream : streams) {
      stream.turn.predict(3 * kFrame_ns, turn);
      stream.alone.predict(3 * kFrame_ns, alone);
      EXPECT_EQ(pixels_of(turn), pixels_of(alone)) << i << " " << stream.width;
      EXPECT_EQ(stream.alone.moves(), i > 0);
    }
  }
}

TEST(MotionPredictor, ThreadsShareAMemoryWithoutHarm) {
  const auto shared = std::make_shared<maq::MotionWorkspaces>();
  const auto stream = [](const std::shared_ptr<maq::MotionWorkspaces>& workspaces, double dx) {
    maq::MotionPredictor predictor({maq::PredictionMethod::kAuto, 1, workspaces});
    std::vector<uint8_t> all;
    maq::Frame predicted;
    for (int i = 0; i < 8; ++i) {
      predictor.push(moving_texture::frame(MAQ_PIXEL_GREY8, 96, 64, dx * i, i, i * kFrame_ns));
      predictor.predict(2 * kFrame_ns, predicted);
      const std::vector<uint8_t> pixels = pixels_of(predicted);
      all.insert(all.end(), pixels.begin(), pixels.end());
    }
    return all;
  };
  std::vector<uint8_t> found[3];
  std::vector<std::thread> threads;
  for (int k = 0; k < 3; ++k) threads.emplace_back([&, k] { found[k] = stream(shared, k - 0.5); });
  for (std::thread& thread : threads) thread.join();
  for (int k = 0; k < 3; ++k) EXPECT_EQ(found[k], stream(nullptr, k - 0.5)) << k;
}

TEST(MotionPredictor, AFurtherOneKeepsLessThanTwoMegabytes) {
  const auto shared = std::make_shared<maq::MotionWorkspaces>();
  std::vector<maq::Frame> frames;
  for (int i = 0; i < 12; ++i) {
    frames.push_back(moving_texture::frame(MAQ_PIXEL_BGR8, 640, 480, 3 * i, i, i * kFrame_ns));
  }
  std::vector<std::unique_ptr<maq::MotionPredictor>> predictors;
  maq::Frame predicted;
  const auto add = [&] {
    predictors.push_back(
        std::make_unique<maq::MotionPredictor>(maq::MotionSettings{maq::PredictionMethod::kAuto, 1, shared}));
    for (const maq::Frame& frame : frames) predictors.back()->push(frame);
    predictors.back()->predict(kFrame_ns, predicted);
  };
  add();
  constexpr int kFurther = 6;
  const double growth_mib = peak_memory_growth_mib([&] {
    for (int i = 0; i < kFurther; ++i) add();
  });
  EXPECT_LT(growth_mib * 1024 * 1024 / kFurther, 2e6);
}

TEST(MotionPredictor, TenThousandFramesRolledOutStayInRangeAndTakeNoMoreMemory) {
  maq::MotionPredictor predictor({maq::PredictionMethod::kAuto, 1});
  maq::Frame frame, next;
  for (int i = 0; i < 8; ++i) {
    frame = moving_texture::frame(MAQ_PIXEL_GREY8, 64, 48, i, 0.25 * i, i * kFrame_ns);
    predictor.push(frame);
  }
  const std::vector<uint8_t> begin = pixels_of(frame);
  const auto [darkest, brightest] = std::minmax_element(begin.begin(), begin.end());
  const auto roll_out = [&](int count) {
    for (int i = 0; i < count; ++i) {
      predictor.predict(kFrame_ns, next);
      predictor.push(next);
    }
  };
  roll_out(200);
  EXPECT_LT(peak_memory_growth_mib([&] { roll_out(9800); }), 1);
  for (const uint8_t value : pixels_of(next)) EXPECT_TRUE(value >= *darkest && value <= *brightest) << int(value);
  EXPECT_EQ(next.timestamp_ns, 10007 * kFrame_ns);
  EXPECT_EQ(predictor.stats().resets, 0u) << "what was made up goes on as well";
}

TEST(MotionPredictor, OneFrameIsTheLastAndNoneIsAStatus) {
  maq::MotionPredictor predictor({maq::PredictionMethod::kAuto, 1});
  maq::Frame frame;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "No frame was pushed", [&] { predictor.predict(0, frame); });
  predictor.push(texture(3, 0, 0));
  expect_last(predictor, texture(3, 0, 0), 0);
  expect_last(predictor, texture(3, 0, 0));
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "-1e-09 s", [&] { predictor.predict(-1, frame); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "11 s", [&] { predictor.predict(11000000000, frame); });
  expect_error(MAQ_ERROR_UNSUPPORTED, "depth", [&] { predictor.push(plain(9, 9, 1, 5, MAQ_PIXEL_DEPTH16)); });
  expect_last(predictor, texture(3, 0, 0));
  predictor.reset();
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "No frame was pushed", [&] { predictor.predict(0, frame); });
}

TEST(MotionPredictor, TimesThatDoNotGoOnResetTheContext) {
  constexpr int64_t kHour_ns = 3600000000000, kFirst = INT64_MIN, kLast = INT64_MAX;
  for (const auto& [before, after] : {std::pair{kHour_ns, kHour_ns - 1},
                                      {kHour_ns, int64_t(0)},
                                      {int64_t(0), kHour_ns},
                                      {kFirst, kLast},
                                      {kLast, kFirst}}) {
    maq::MotionPredictor predictor({maq::PredictionMethod::kMotion, 1});
    predictor.push(texture(0, 0, before));
    predictor.push(texture(2, 0, after));
    EXPECT_EQ(predictor.stats().resets, 1u);
    expect_last(predictor, texture(2, 0, 0));
    if (after > kHour_ns) continue;
    predictor.push(texture(4, 0, after + kFrame_ns));
    maq::Frame predicted;
    predictor.predict(kFrame_ns, predicted);
    EXPECT_LE(worst_error_px(predicted, 6, 0, 20), 0.25) << "it goes on from there";
  }
}

TEST(MotionPredictor, AFrameOfTheSameTimeReplacesTheOneBefore) {
  maq::MotionPredictor predictor({maq::PredictionMethod::kMotion, 1});
  predictor.push(texture(0, 0, 0));
  predictor.push(texture(5, 0, kFrame_ns));
  predictor.push(texture(1, 0, kFrame_ns));
  maq::Frame predicted;
  predictor.predict(3 * kFrame_ns, predicted);
  EXPECT_LE(worst_error_px(predicted, 4, 0, 20), 0.25);
}

TEST(MotionPredictor, AnotherSizeFormatOrClockResetsTheContext) {
  for (int change = 0; change < 4; ++change) {
    maq::MotionPredictor predictor({maq::PredictionMethod::kMotion, 1});
    predictor.push(texture(0, 0, 0));
    predictor.push(texture(2, 0, kFrame_ns));
    maq::Frame other = moving_texture::frame(change == 0 ? MAQ_PIXEL_NV12 : MAQ_PIXEL_GREY8, change == 1 ? 160 : kWidth,
                                             change == 2 ? 120 : kHeight, 4, 0, 2 * kFrame_ns);
    if (change == 3) other.clock = MAQ_CLOCK_MONOTONIC;
    predictor.push(other);
    EXPECT_EQ(predictor.stats().resets, 1u) << change;
    expect_last(predictor, other);
  }
}

TEST(MotionPredictor, NothingOfTheSceneBeforeACutIsPredictedAfterIt) {
  const auto other_scene = [](int i, int64_t time_ns) {
    maq::Frame frame = texture(0, 0, time_ns);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        frame.storage[size_t(y * kWidth + x)] =
            uint8_t(120 + 60 * std::sin(0.09 * (x - i) * (1 + 0.003 * y)) + 50 * std::sin(0.13 * y + 0.0004 * x * x));
      }
    }
    return frame;
  };
  const maq::Frame scenes[] = {other_scene(0, 3 * kFrame_ns), plain(kWidth, kHeight, 0, 3 * kFrame_ns),
                               noise(kWidth, kHeight, 9, 3 * kFrame_ns)};
  for (const maq::Frame& after : scenes) {
    for (const maq::PredictionMethod method : {maq::PredictionMethod::kAuto, maq::PredictionMethod::kMotion}) {
      maq::MotionPredictor predictor({method, 1});
      for (int i = 0; i < 3; ++i) predictor.push(texture(2 * i, 0, i * kFrame_ns));
      predictor.push(after);
      expect_last(predictor, after);
      EXPECT_EQ(predictor.stats().resets, 1u);
    }
  }
  // The motion after it is that of the new scene.
  maq::MotionPredictor predictor({maq::PredictionMethod::kMotion, 1});
  for (int i = 0; i < 3; ++i) predictor.push(texture(2 * i, 0, i * kFrame_ns));
  for (int i = 3; i < 5; ++i) predictor.push(other_scene(i, i * kFrame_ns));
  maq::Frame predicted;
  predictor.predict(2 * kFrame_ns, predicted);
  EXPECT_EQ(predictor.stats().method, maq::PredictionMethod::kMotion);
  const maq::Frame truth = other_scene(6, 0);
  double sum = 0;
  for (size_t i = 0; i < truth.storage.size(); ++i) sum += std::abs(predicted.storage[i] - truth.storage[i]);
  EXPECT_LT(sum / double(truth.storage.size()), 3);
}

TEST(MotionPredictor, TheSameBitsForAnyNumberOfThreads) {
  std::vector<std::vector<uint8_t>> found;
  for (const int threads : {1, 2, 3}) {
    maq::MotionPredictor predictor({maq::PredictionMethod::kAuto, threads});
    maq::Frame predicted;
    for (int i = 0; i < 5; ++i) {
      predictor.push(moving_texture::frame(MAQ_PIXEL_BGR8, 640, 480, 3.3 * i, -1.7 * i, i * kFrame_ns));
    }
    predictor.predict(3 * kFrame_ns, predicted);
    EXPECT_EQ(predictor.stats().method, maq::PredictionMethod::kMotion);
    found.push_back(pixels_of(predicted));
  }
  EXPECT_EQ(found[0], found[1]);
  EXPECT_EQ(found[0], found[2]);
}

}  // namespace
