// The mean of depth over frames of a camera at rest.
#include "edges/depth_average.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "edges/edges.h"
#include "support/samples/tiny_edges.h"

namespace depth_average {
namespace {

constexpr int kWide = 150, kHigh = 100;
constexpr double kFocal_px = 300;
const maq::Intrinsics kCamera{kWide, kHigh, kFocal_px, kFocal_px, 74.5, 49.5};

using Depth = std::vector<float>;

// A wall that leans, with a box before it.
double exact(int x, int y, double nearer = 0) {
  const bool box = x > 60 && x < 110 && y > 30 && y < 70;
  return (box ? 1.2 : 1.5) / (1 + 0.3 * (x - 74.5) / kFocal_px) - nearer;
}

Depth frame(double noise_r, unsigned seed, double nearer = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_r / kFocal_px);
  Depth depth;
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 0; x < kWide; ++x) depth.push_back(float(exact(x, y, nearer) * (1 + noise(random))));
  }
  return depth;
}

class DepthAverage : public ::testing::Test {
 protected:
  int64_t add(Depth& depth, maq::DepthAverage& average, const maq::Intrinsics& camera = kCamera) {
    return average.add(depth.data(), camera, workers_);
  }

  maq::WorkerThreads workers_{2};
};

// Root mean square, footprints.
double error_of(const Depth& depth, double nearer = 0) {
  double squares = 0;
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 0; x < kWide; ++x) {
      const double z = exact(x, y, nearer), off = (double(depth[size_t(y * kWide + x)]) - z) / z * kFocal_px;
      squares += off * off;
    }
  }
  return std::sqrt(squares / double(depth.size()));
}

TEST_F(DepthAverage, NoiseFallsWithTheRootOfTheFramesAndNoFurtherThanAsked) {
  maq::DepthAverage average(16);
  std::vector<double> errors;
  for (unsigned k = 0; k < 64; ++k) {
    Depth depth = frame(1, k);
    const int64_t averaged = add(depth, average);
    EXPECT_GE(averaged, k == 0 ? 0 : kWide * kHigh * 99 / 100);
    EXPECT_EQ(averaged == 0, k == 0);
    errors.push_back(error_of(depth));
  }
  EXPECT_NEAR(errors[0], 1, 0.03);
  EXPECT_LT(errors[3], 0.6);
  EXPECT_LT(errors[15], 0.35);
  EXPECT_GT(errors[63], 0.12);  // the mean of all would have 0.125; of the last 16 with fading 0.18
}

TEST_F(DepthAverage, WhatMovesIsShownAsItIs) {
  for (const double noise_r : {0.0, 0.5}) {
    maq::DepthAverage average(16);
    for (unsigned k = 0; k < 12; ++k) {
      Depth depth = frame(noise_r, k);
      add(depth, average);
    }
    Depth moved = frame(noise_r, 100, 0.05);  // 10 footprints towards the camera
    const Depth given = moved;
    EXPECT_EQ(add(moved, average), 0);
    EXPECT_EQ(moved, given);
  }
}

// By less than the noise in each frame, so that none of them tells it from noise.
TEST_F(DepthAverage, FallsBehindASlowMotionByNoMoreThanTheNoise) {
  maq::DepthAverage average(64);
  double nearer = 0;
  for (unsigned k = 0; k < 120; ++k, nearer += 0.0005) {  // a tenth of a footprint a frame
    Depth depth = frame(1, k, nearer);
    add(depth, average);
    EXPECT_LT(error_of(depth, nearer), 1.3) << k;
  }
}

TEST_F(DepthAverage, ATurnAboutTheMiddleOfAnAreaIsMotion) {
  const auto turned = [](double angle) {
    Depth depth;
    for (int y = 0; y < kHigh; ++y) {
      for (int x = 0; x < kWide; ++x) depth.push_back(float(1 / (1 + angle * (x % 32 - 15.5) / kFocal_px)));
    }
    return depth;
  };
  maq::DepthAverage average(16);
  for (int k = 0; k < 6; ++k) {
    Depth depth = turned(0.02 * k);
    const Depth given = depth;
    EXPECT_EQ(add(depth, average), 0);
    EXPECT_EQ(depth, given);
  }
}

TEST_F(DepthAverage, AThingThatMovesLeavesTheRestAsSteadyAsItWas) {
  maq::DepthAverage average(16);
  for (unsigned k = 0; k < 16; ++k) {
    Depth depth = frame(0.5, k);
    add(depth, average);
  }
  Depth depth = frame(0.5, 77);
  const auto hand = [](int x, int y) { return x >= 5 && x < 15 && y >= 5 && y < 15; };
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 0; x < kWide; ++x) {
      if (hand(x, y)) depth[size_t(y * kWide + x)] = 0.8f;
    }
  }
  add(depth, average);
  double squares = 0, count = 0;
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 0; x < kWide; ++x) {
      const float z = depth[size_t(y * kWide + x)];
      if (hand(x, y)) {
        EXPECT_EQ(z, 0.8f);
      } else {
        const double off = (double(z) - exact(x, y)) / exact(x, y) * kFocal_px;
        squares += off * off;
        count += 1;
      }
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 0.25);
}

TEST_F(DepthAverage, UnknownStaysUnknownAndWhatComesBackHasItsMean) {
  maq::DepthAverage average(8);
  for (unsigned k = 0; k < 8; ++k) {
    Depth depth = frame(0.5, k);
    for (size_t at = 0; at < depth.size(); at += 7) depth[at] = k % 2 == 1 ? 0 : depth[at];
    const Depth given = depth;
    add(depth, average);
    for (size_t at = 0; at < depth.size(); ++at) EXPECT_EQ(depth[at] == 0, given[at] == 0);
  }
  Depth none(size_t(kWide) * kHigh, 0);
  EXPECT_EQ(add(none, average), 0);
  EXPECT_EQ(none, Depth(none.size(), 0));
}

TEST_F(DepthAverage, AnotherSizeOrCameraBeginsAnewAndOneFrameAloneStays) {
  maq::DepthAverage average(8), alone(1);
  for (unsigned k = 0; k < 3; ++k) {
    Depth depth = frame(0.5, k);
    const Depth given = depth;
    EXPECT_EQ(add(depth, alone), 0);
    EXPECT_EQ(depth, given);
    add(depth, average);
  }
  maq::Intrinsics other = kCamera;
  other.fx_px += 1;
  Depth depth = frame(0.5, 9);
  const Depth given = depth;
  EXPECT_EQ(add(depth, average, other), 0);
  EXPECT_EQ(depth, given);
  Depth small(17 * 31, 1);
  EXPECT_EQ(add(small, average, {17, 31, 40, 40, 8, 15}), 0);
  EXPECT_EQ(add(small, average, {17, 31, 40, 40, 8, 15}), 17 * 31);
}

TEST_F(DepthAverage, IsTheSameForAnyNumberOfThreads) {
  maq::DepthAverage one(16), many(16);
  maq::WorkerThreads single(1), several(3);
  for (unsigned k = 0; k < 5; ++k) {
    Depth first = frame(1, k), second = first;
    EXPECT_EQ(one.add(first.data(), kCamera, single), many.add(second.data(), kCamera, several));
    EXPECT_EQ(first, second);
  }
}

// The field's own depth is the mean, from which curves are made.
TEST_F(DepthAverage, TheFieldIsThatOfTheMean) {
  const auto edges = tiny_edges::edges(1, 16);
  maq::EdgesResult result;
  for (unsigned k = 0; k < 16; ++k) {
    const Depth depth = frame(1, k);
    edges->run(tiny_edges::view_of(depth, kWide, kHigh), kCamera, result);
  }
  EXPECT_LT(error_of(result.field.depth_m), 0.35);
  EXPECT_GT(result.stats.averaged_pixels, kWide * kHigh * 99 / 100);
}

}  // namespace
}  // namespace depth_average
