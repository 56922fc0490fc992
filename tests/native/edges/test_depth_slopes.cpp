// The network's input, against torch (make_tiny_edges.py) and against what geometry says.
#include "edges/depth_slopes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "support/samples/tiny_edges.h"

namespace {

using maq::DepthSlopes;
using maq::FieldWindow;
using maq::Intrinsics;

// Slopes in x and y and whether depth is known, by pixel of a window.
struct Unfolded {
  std::vector<float> across, down, known;
};

Unfolded unfolded(const float* values, const FieldWindow& window) {
  const size_t pixels = size_t(window.width_px) * size_t(window.height_px);
  Unfolded planes{std::vector<float>(pixels), std::vector<float>(pixels), std::vector<float>(pixels)};
  for (int y = 0; y < window.height_px; ++y) {
    for (int x = 0; x < window.width_px; ++x) {
      const float* cell =
          values + (size_t(y / 2) * size_t(window.width_px / 2) + size_t(x / 2)) * DepthSlopes::kChannels;
      const size_t at = size_t(y) * size_t(window.width_px) + size_t(x), corner = size_t(2 * (y % 2) + x % 2);
      planes.across[at] = cell[corner];
      planes.down[at] = cell[4 + corner];
      planes.known[at] = cell[8 + corner];
    }
  }
  return planes;
}

Unfolded slopes_of(const std::vector<float>& depth, const Intrinsics& camera, int threads = 1) {
  maq::WorkerThreads workers(threads);
  DepthSlopes slopes;
  const FieldWindow window{0, 0, (camera.width_px + 1) / 2 * 2, (camera.height_px + 1) / 2 * 2};
  std::vector<float> values(DepthSlopes::count(window));
  slopes.make({depth.data(), camera.width_px, camera.height_px}, camera, window, workers, values.data());
  return unfolded(values.data(), window);
}

// A plane a x' + b y' + c of inverse depth, where x' and y' are directions: its slopes are a / (1/z) and b / (1/z).
struct Plane {
  double a, b, c;
  double inverse(const Intrinsics& camera, double x, double y) const {
    return a * (x - camera.cx_px) / camera.fx_px + b * (y - camera.cy_px) / camera.fy_px + c;
  }
};

std::vector<float> depth_of(const Plane& plane, const Intrinsics& camera, double scale = 1) {
  std::vector<float> depth;
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) depth.push_back(float(scale / plane.inverse(camera, x, y)));
  }
  return depth;
}

double squashed(double slope) { return slope / (1 + std::abs(slope)); }

TEST(DepthSlopes, EqualTorch) {
  for (const tiny_edges::Case& size : tiny_edges::kCases) {
    const std::vector<float> depth = size.read("depth"), expected = size.read("slopes");
    maq::WorkerThreads threads(1);
    DepthSlopes slopes;
    const FieldWindow window{0, 0, (size.width + 3) / 4 * 4, (size.height + 3) / 4 * 4};
    std::vector<float> found(DepthSlopes::count(window));
    slopes.make({depth.data(), size.width, size.height}, size.intrinsics(), window, threads, found.data());
    ASSERT_EQ(expected.size(), found.size());
    for (size_t i = 0; i < expected.size(); ++i) ASSERT_NEAR(found[i], expected[i], 1e-6) << size.name() << " " << i;
  }
}

// z d(1/z) f: constant along lines of constant inverse depth, and where the plane faces the camera everywhere.
TEST(DepthSlopes, APlaneAtAnyTiltHasTheSlopeThatGeometrySays) {
  const Intrinsics camera{64, 48, 70, 70, 31.5, 23.5};
  for (const double degrees : {0.0, 10.0, 45.0, 60.0, 80.0, 85.0, 87.0}) {
    for (const double turn : {0.0, 0.6, 1.57, 3.0, 5.0}) {
      const double steepness = std::tan(degrees * 3.14159265358979 / 180);
      const Plane plane{steepness * std::cos(turn), steepness * std::sin(turn), 1};
      const std::vector<float> depth = depth_of(plane, camera);
      const Unfolded found = slopes_of(depth, camera);
      for (int y = 0; y < 47; ++y) {
        for (int x = 0; x < 63; ++x) {
          const double inverse = plane.inverse(camera, x, y);
          if (inverse < 0.01 || plane.inverse(camera, x + 1, y) < 0.01 || plane.inverse(camera, x, y + 1) < 0.01)
            continue;
          const size_t at = size_t(y) * 64 + size_t(x);
          ASSERT_NEAR(found.across[at], squashed(plane.a / inverse), 1e-4) << degrees << " " << turn;
          ASSERT_NEAR(found.down[at], squashed(plane.b / inverse), 1e-4) << degrees << " " << turn;
        }
      }
    }
  }
}

TEST(DepthSlopes, DoNotDependOnTheScaleOfTheScene) {
  const Intrinsics camera{40, 30, 50, 50, 19.5, 14.5};
  const Plane plane{0.3, -0.5, 1};
  const Unfolded one = slopes_of(depth_of(plane, camera), camera);
  for (const double metres : {0.01, 0.1, 3.0, 100.0}) {
    const Unfolded found = slopes_of(depth_of(plane, camera, metres), camera);
    for (size_t i = 0; i < one.across.size(); ++i) {
      ASSERT_NEAR(found.across[i], one.across[i], 1e-4) << metres;
      ASSERT_NEAR(found.down[i], one.down[i], 1e-4) << metres;
    }
  }
}

TEST(DepthSlopes, FocalLengthsFrom10To10000AndPixelsThatAreNotSquareGiveTheSameSlopes) {
  for (const double focal_px : {10.0, 100.0, 1000.0, 10000.0}) {
    for (const double ratio : {1.0, 0.5, 1.7}) {
      const Intrinsics camera{8, 6, focal_px, ratio * focal_px, -40, 900};  // the principal point is outside
      Plane plane{0.3, -0.2, 1};
      plane.c -= plane.inverse(camera, 4, 3) - 1;  // at 1 m in the image
      const Unfolded found = slopes_of(depth_of(plane, camera), camera);
      // Depth of 24 bits at 1 m: a slope is uncertain by the focal length times 2^-23.
      const double tolerance = 1e-5 + 4 * focal_px * 6e-8;
      const double inverse = plane.inverse(camera, 2, 2);
      EXPECT_NEAR(found.across[2 * 8 + 2], squashed(plane.a / inverse), tolerance) << focal_px << " " << ratio;
      EXPECT_NEAR(found.down[2 * 8 + 2], squashed(plane.b / inverse), tolerance) << focal_px << " " << ratio;
    }
  }
}

TEST(DepthSlopes, AreZeroBesideWhatIsUnknownAndAtTheLastColumnAndRow) {
  const Intrinsics camera{6, 4, 10, 10, 2.5, 1.5};
  std::vector<float> depth = depth_of({0.3, 0.2, 1}, camera);
  depth[1 * 6 + 2] = 0;
  const Unfolded found = slopes_of(depth, camera);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 6; ++x) {
      const size_t at = size_t(6 * y + x);
      const bool known = !(x == 2 && y == 1);
      EXPECT_EQ(found.known[at], known ? 1 : 0);
      EXPECT_EQ(found.across[at] != 0, known && x < 5 && !(x == 1 && y == 1)) << x << " " << y;
      EXPECT_EQ(found.down[at] != 0, known && y < 3 && !(x == 2 && y == 0)) << x << " " << y;
    }
  }
}

TEST(DepthSlopes, AnyDepthGivesNumbersWithinOne) {
  const float values[] = {0, 1.2e-38f, 1e-30f, 1e-9f, 0.5f, 1, 1.0000001f, 1e9f, 1e30f, 3.4e38f};
  std::mt19937 random(1);
  std::uniform_int_distribution<size_t> any(0, std::size(values) - 1);
  for (const double focal_px : {1e-3, 10.0, 500.0, 10000.0, 1e9}) {
    const Intrinsics camera{32, 32, focal_px, focal_px, 0, 0};
    std::vector<float> depth(32 * 32);
    for (float& z : depth) z = values[any(random)];
    const Unfolded found = slopes_of(depth, camera);
    for (size_t i = 0; i < depth.size(); ++i) {
      ASSERT_LE(std::abs(found.across[i]), 1) << focal_px;
      ASSERT_LE(std::abs(found.down[i]), 1) << focal_px;
      ASSERT_EQ(found.known[i], depth[i] > 0 ? 1 : 0);
    }
  }
}

TEST(DepthSlopes, OfAWindowAreThoseOfTheFrameThereWhicheverThreadsAreAtWork) {
  const Intrinsics camera{75, 133, 60, 66, 37, 66};
  std::vector<float> depth(75 * 133);
  std::mt19937 random(2);
  std::uniform_real_distribution<float> any(-0.2f, 3);
  for (float& z : depth) z = std::max(0.0f, any(random));
  maq::WorkerThreads one(1), two(2);
  DepthSlopes slopes;
  const FieldWindow all{0, 0, 90, 150};  // beyond the frame there are mirrors
  const auto of_window = [&](const FieldWindow& window, maq::WorkerThreads& threads) {
    std::vector<float> values(DepthSlopes::count(window));
    slopes.make({depth.data(), 75, 133}, camera, window, threads, values.data());
    return unfolded(values.data(), window);
  };
  const Unfolded whole = of_window(all, one);
  for (const FieldWindow& window :
       {FieldWindow{0, 0, 76, 134}, {10, 24, 40, 64}, {40, 100, 36, 36}, {60, 124, 20, 20}}) {
    const Unfolded part = of_window(window, two);
    for (int y = 0; y < window.height_px; ++y) {
      for (int x = 0; x < window.width_px; ++x) {
        const size_t at = size_t(y) * size_t(window.width_px) + size_t(x);
        const int column = window.left_px + x, row = window.top_px + y;
        const size_t there = size_t(row) * size_t(all.width_px) + size_t(column);
        ASSERT_EQ(part.across[at], whole.across[there]);
        ASSERT_EQ(part.down[at], whole.down[there]);
        ASSERT_EQ(part.known[at], whole.known[there]);
      }
    }
  }
}

}  // namespace
