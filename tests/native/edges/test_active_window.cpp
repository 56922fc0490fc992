// Which part of a frame may have an edge.
#include "edges/active_window.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/samples/tiny_edges.h"

namespace {

constexpr int kWide = 320, kHigh = 240, kMultiple = 16;
const maq::Intrinsics kCamera{kWide, kHigh, 300, 300, 159.5, 119.5};

maq::FieldWindow window_of(const std::vector<float>& depth, const maq::Intrinsics& camera = kCamera, int threads = 1) {
  maq::WorkerThreads workers(threads);
  maq::ActiveWindow active;
  return active.find({depth.data(), camera.width_px, camera.height_px}, camera, kMultiple, workers);
}

// A plane at about 1.5 m, with noise in footprints.
std::vector<float> plane(double across, double down, double noise_r, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_r / 300);
  std::vector<float> depth;
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 0; x < kWide; ++x) {
      const double z = 1.5 / (1 + across * (x - 159.5) / 300 + down * (y - 119.5) / 300);
      depth.push_back(float(z * (1 + noise(random))));
    }
  }
  return depth;
}

TEST(ActiveWindow, ThereIsNoneWhereAPlaneExplainsTheFrameWithinItsNoise) {
  for (const auto& [across, down] : {std::pair{0.0, 0.0}, {0.3, -0.2}, {1.2, 0.8}}) {
    for (const double noise_r : {0.0, 0.125, 0.5, 1.0, 4.0}) {
      for (unsigned seed = 0; seed < 3; ++seed) {
        EXPECT_EQ(window_of(plane(across, down, noise_r, seed)).width_px, 0) << across << " " << noise_r;
      }
    }
  }
  EXPECT_EQ(window_of(std::vector<float>(kWide * kHigh, 0)).width_px, 0) << "nor without depth";
}

// Wherever a crease or a step lies to the areas that are tested; 18 degrees is what counts as sharp.
TEST(ActiveWindow, HoldsEveryCreaseOf18DegreesAndEveryStepOf2Footprints) {
  for (int at = 100; at < 132; at += 3) {
    std::vector<float> crease = plane(0, 0, 0), step = crease;
    for (int y = 40; y < 72; ++y) {
      for (int x = at; x < at + 40; ++x) {
        step[size_t(y * kWide + x)] -= 2 * 1.5f / 300;
        crease[size_t(y * kWide + x)] /= float(1 + 0.325 * (x - at) / 300);
      }
    }
    for (const auto& depth : {crease, step}) {
      const maq::FieldWindow window = window_of(depth);
      ASSERT_GT(window.width_px, 0) << at;
      EXPECT_LE(window.left_px, at - 16);
      EXPECT_GE(window.left_px + window.width_px, at + 40 + 16);
      EXPECT_LE(window.top_px, 40 - 16);
      EXPECT_GE(window.top_px + window.height_px, 72 + 16);
      EXPECT_EQ(window.width_px, 160) << "half of the frame is enough";
      EXPECT_EQ(window.height_px, 128) << "half of the frame, rounded up";
    }
  }
}

TEST(ActiveWindow, HoldsWhereDepthEnds) {
  std::vector<float> depth = plane(0.2, 0, 0);
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 200; x < kWide; ++x) depth[size_t(y * kWide + x)] = 0;
  }
  const maq::FieldWindow window = window_of(depth);
  EXPECT_LE(window.left_px, 200 - 16);
  EXPECT_GE(window.left_px + window.width_px, 200 + 16);
  EXPECT_EQ(window.height_px, kHigh);
}

TEST(ActiveWindow, IsInsideThePaddedFrameWhateverIsInIt) {
  std::mt19937 random(9);
  for (const auto& [width, height] :
       {std::pair{1, 1}, {17, 31}, {4000, 1}, {1, 300}, {33, 65}, {100, 90}, {250, 130}}) {
    const maq::Intrinsics camera{width, height, 80, 90, 3, 4};
    for (int trial = 0; trial < 40; ++trial) {
      std::vector<float> depth(size_t(width * height), trial % 2 == 0 ? 1.0f : 0.0f);
      for (int k = 0; k < 3; ++k) depth[random() % depth.size()] = trial % 3 == 0 ? 3e38f : 2.0f;
      const maq::FieldWindow window = window_of(depth, camera);
      if (window.width_px == 0) continue;
      ASSERT_TRUE(window.left_px >= 0 && window.top_px >= 0);
      ASSERT_LE(window.left_px + window.width_px, (width + 15) / 16 * 16);
      ASSERT_LE(window.top_px + window.height_px, (height + 15) / 16 * 16);
      for (const int side : {window.left_px, window.top_px, window.width_px, window.height_px}) ASSERT_EQ(side % 16, 0);
    }
  }
}

TEST(ActiveWindow, IsTheSameWhicheverThreadsAreAtWork) {
  std::vector<float> depth = plane(0.3, 0.1, 0.3);
  for (int y = 100; y < 140; ++y) depth[size_t(y * kWide + 60)] = 1;
  const maq::FieldWindow one = window_of(depth), two = window_of(depth, kCamera, 2);
  EXPECT_EQ(one.left_px, two.left_px);
  EXPECT_EQ(one.width_px, two.width_px);
  EXPECT_EQ(one.top_px, two.top_px);
  EXPECT_EQ(one.height_px, two.height_px);
}

// The network's receptive field has a radius of 18 px; the window keeps 32 px around what is no plane.
TEST(ActiveWindow, InsideOfItTheFieldIsThatOfTheWholeFrame) {
  std::vector<float> depth = plane(0.3, 0.1, 0);
  for (int y = 20; y < 50; ++y) {
    for (int x = 40; x < 80; ++x) depth[size_t(y * kWide + x)] = 1;
  }
  maq::EdgesSettings settings;
  maq::EdgesResult whole, part;
  maq::Edges(tiny_edges::runtime(), maq::read_bundle(tiny_edges::kBundle), settings)
      .run(tiny_edges::view_of(depth, kWide, kHigh), kCamera, whole);
  settings.skips_planes = true;
  maq::Edges(tiny_edges::runtime(), maq::read_bundle(tiny_edges::kBundle), settings)
      .run(tiny_edges::view_of(depth, kWide, kHigh), kCamera, part);
  EXPECT_EQ(part.stats.network_pixels, 160 * 120);
  EXPECT_EQ(whole.stats.network_pixels, kWide * kHigh);
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 0; x < kWide; ++x) {
      const size_t at = size_t(y * kWide + x);
      const bool is_near = x >= 40 - 16 && x < 80 + 16 && y >= 20 - 16 && y < 50 + 16;
      if (is_near) {
        ASSERT_NEAR(part.field.distance_r[at], whole.field.distance_r[at], 1e-3) << x << " " << y;
      }
      if (x >= 200) {
        ASSERT_EQ(part.field.distance_r[at], tiny_edges::kEps_r);
        ASSERT_EQ(part.field.kind[at], maq::kNoEdge);
      }
    }
  }
}

}  // namespace
