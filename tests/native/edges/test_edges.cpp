// Depth frames to fields: against torch, at any size, of any content.
#include "edges/edges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "support/expect_error.h"
#include "support/samples/tiny_edges.h"

namespace {

using tiny_edges::kEps_r;
using tiny_edges::view_of;

maq::Intrinsics camera_of(int width, int height, double focal_px = 40) {
  return {width, height, focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0};
}

maq::EdgesResult run(maq::Edges& edges, const std::vector<float>& depth, int width, int height) {
  maq::EdgesResult result;
  edges.run(view_of(depth, width, height), camera_of(width, height), result);
  return result;
}

std::vector<float> noise(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> any(-0.5f, 4);
  std::vector<float> depth(size_t(width) * size_t(height));
  for (float& z : depth) z = any(random);
  return depth;
}

bool is_clear(const maq::EdgeField& field, size_t at) {
  return field.distance_r[at] == kEps_r && field.expected_error_r[at] == kEps_r && field.kind[at] == maq::kNoEdge;
}

TEST(Edges, TheFieldIsTheAnswerOfTorch) {
  for (const tiny_edges::Case& size : tiny_edges::kCases) {
    const auto edges = tiny_edges::edges();
    const std::vector<float> depth = size.read("depth"), planes = size.read("planes");
    maq::EdgesResult result;
    edges->run(view_of(depth, size.width, size.height), size.intrinsics(), result);
    const maq::EdgeField& field = result.field;
    ASSERT_EQ(field.distance_r.size(), depth.size());
    EXPECT_EQ(field.depth_m, depth);
    const int columns = (size.width + 3) / 4 * 2;
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const size_t at = size_t(y * size.width + x);
        if (depth[at] == 0) {
          EXPECT_TRUE(is_clear(field, at));
          continue;
        }
        const float* cell = planes.data() + size_t(y / 2 * columns + x / 2) * 16 + size_t(2 * (y % 2) + x % 2);
        const float distance = std::clamp(cell[0] * kEps_r, 0.0f, kEps_r);
        ASSERT_NEAR(field.distance_r[at], distance, 1e-4) << x << " " << y;
        ASSERT_NEAR(field.expected_error_r[at], kEps_r * std::exp(std::clamp(cell[4], -7.0f, 1.0f)), 1e-3);
        if (std::abs(cell[8] - cell[12]) < 1e-4f || std::abs(distance - kEps_r) < 1e-4f) continue;
        ASSERT_EQ(field.kind[at], distance == kEps_r ? 0 : cell[8] > cell[12] ? 1 : 2);
      }
    }
    EXPECT_EQ(result.stats.network_pixels, 2 * columns * ((size.height + 3) / 4 * 4));
  }
}

TEST(Edges, FramesOfAnySizeTakeTurns) {
  const auto edges = tiny_edges::edges(2);
  for (const auto& [width, height] :
       {std::pair{1, 1}, {17, 31}, {4000, 1}, {1, 4000}, {2, 3}, {17, 31}, {320, 240}, {16384, 3}}) {
    const std::vector<float> depth = noise(width, height, 5);
    const maq::EdgesResult result = run(*edges, depth, width, height);
    EXPECT_EQ(result.field.width, width);
    EXPECT_EQ(result.field.height, height);
    ASSERT_EQ(result.field.kind.size(), depth.size());
    int64_t known = 0;
    for (size_t i = 0; i < depth.size(); ++i) {
      ASSERT_TRUE(result.field.distance_r[i] >= 0 && result.field.distance_r[i] <= kEps_r);
      ASSERT_TRUE(result.field.expected_error_r[i] > 0 && result.field.expected_error_r[i] < 3 * kEps_r);
      ASSERT_LE(result.field.kind[i], 2);
      ASSERT_EQ(result.field.depth_m[i], std::max(depth[i], 0.0f));
      known += depth[i] > 0;
      ASSERT_TRUE(depth[i] > 0 || is_clear(result.field, i));
    }
    EXPECT_EQ(result.stats.known_pixels, known);
  }
}

TEST(Edges, FramesThatAreTooLargeAreRefusedBeforeMemoryIsTaken) {
  const auto edges = tiny_edges::edges();
  const uint8_t pixel[4] = {};
  for (const auto& size : {std::pair{4096, 3072}, {16384, 4096}}) {
    const int width = size.first, height = size.second;
    const maq::ImageView depth{MAQ_PIXEL_DEPTH16, width, height, {{pixel, 0}, {}}};
    maq::EdgesResult result;
    expect_error(MAQ_ERROR_IMAGE_SIZE, std::to_string(width) + " x " + std::to_string(height),
                 [&] { edges->run(depth, camera_of(width, height), result); });
    EXPECT_EQ(result.field.distance_r.capacity(), 0u);
  }
}

TEST(Edges, WithoutDepthTheNetworkDoesNotRun) {
  const auto edges = tiny_edges::edges();
  const float unknown[] = {0,
                           -1,
                           std::numeric_limits<float>::quiet_NaN(),
                           std::numeric_limits<float>::infinity(),
                           -std::numeric_limits<float>::infinity(),
                           1e-42f};
  std::vector<float> depth(50 * 30);
  for (size_t i = 0; i < depth.size(); ++i) depth[i] = unknown[i % std::size(unknown)];
  const maq::EdgesResult result = run(*edges, depth, 50, 30);
  EXPECT_EQ(result.stats.known_pixels, 0);
  EXPECT_EQ(result.stats.network_pixels, 0);
  for (size_t i = 0; i < depth.size(); ++i) {
    ASSERT_TRUE(is_clear(result.field, i));
    ASSERT_EQ(result.field.depth_m[i], 0);
  }
}

TEST(Edges, HolesStayHolesAndDoNotSpread) {
  const auto edges = tiny_edges::edges();
  std::vector<float> depth(48 * 48, 1.5f);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 48; ++x) {
      const int ring = std::max(std::abs(x - 24), std::abs(y - 24));
      if ((x + y) % 2 == 0 || ring == 9) depth[size_t(48 * y + x)] = 0;
    }
  }
  const maq::EdgesResult result = run(*edges, depth, 48, 48);
  for (size_t i = 0; i < depth.size(); ++i) {
    ASSERT_EQ(result.field.expected_error_r[i] == kEps_r, depth[i] == 0);
    ASSERT_TRUE(depth[i] > 0 || is_clear(result.field, i));
  }
}

// One known pixel, one row, one column, and 1 pixel in 100: what is known has an answer, and nothing else.
TEST(Edges, AFewKnownPixelsHaveAnAnswerAndNoOthers) {
  const auto edges = tiny_edges::edges();
  constexpr int kWidth = 61, kHeight = 45;
  std::mt19937 random(11);
  std::vector<bool> sparse(size_t(kWidth * kHeight));
  for (size_t i = 0; i < sparse.size(); ++i) sparse[i] = random() % 100 == 0;
  const std::function<bool(int, int)> masks[] = {
      [](int x, int y) { return x == 30 && y == 20; },
      [](int, int y) { return y == 20; },
      [](int x, int) { return x == kWidth - 1; },
      [&](int x, int y) { return bool(sparse[size_t(y * kWidth + x)]); },
      [](int x, int y) { return (x / 8 + y / 8) % 2 == 0; },
      [](int x, int y) { return int(std::hypot(x - 30, y - 22)) % 3 == 0; },
  };
  for (const auto& is_known : masks) {
    std::vector<float> depth(size_t(kWidth * kHeight));
    int64_t known = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (!is_known(x, y)) continue;
        depth[size_t(y * kWidth + x)] = 1.5f + 0.01f * float(x);
        ++known;
      }
    }
    const maq::EdgesResult result = run(*edges, depth, kWidth, kHeight);
    EXPECT_EQ(result.stats.known_pixels, known);
    EXPECT_EQ(result.stats.broken_pixels, 0);
    for (size_t i = 0; i < depth.size(); ++i) {
      if (depth[i] > 0) {
        ASSERT_TRUE(std::isfinite(result.field.distance_r[i]) && result.field.expected_error_r[i] < 3 * kEps_r);
      } else {
        ASSERT_TRUE(is_clear(result.field, i));
      }
    }
  }
}

// Units that differ by powers of two, so that not even rounding may differ.
TEST(Edges, TheUnitOf16BitDepthIsWithoutEffect) {
  const auto edges = tiny_edges::edges();
  std::vector<float> depth;
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) depth.push_back(std::rint(1000 + (x > 20 && y > 25 ? -200 : 3 * float(x))));
  }
  const maq::EdgesResult expected = run(*edges, depth, 64, 48);
  for (const float unit : {1.0f / 1024, 1.0f / 4096, 1.0f / 16384}) {
    std::vector<float> scaled = depth;
    for (float& z : scaled) z *= unit;
    const maq::EdgesResult result = run(*edges, scaled, 64, 48);
    EXPECT_EQ(result.field.distance_r, expected.field.distance_r);
    EXPECT_EQ(result.field.expected_error_r, expected.field.expected_error_r);
    EXPECT_EQ(result.field.kind, expected.field.kind);
  }
}

// 16 bits of millimetres with rows far apart, and the same as packed floats.
TEST(Edges, DepthOf16BitsWithPaddedRowsGivesWhatMetresGive) {
  const auto edges = tiny_edges::edges();
  constexpr int kWidth = 37, kHeight = 21;
  constexpr size_t kStride = 2 * kWidth + 9;  // rows begin at odd addresses
  std::vector<uint8_t> rows(kStride * kHeight, 0xcd);
  std::vector<float> metres;
  std::mt19937 random(4);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const uint16_t stored = (x + y) % 7 == 0 ? 0 : (x + y) % 7 == 1 ? 65535 : uint16_t(500 + random() % 3000);
      std::memcpy(rows.data() + size_t(y) * kStride + size_t(2 * x), &stored, 2);
      metres.push_back(stored == 65535 ? 0 : float(stored) * 0.001f);
    }
  }
  maq::EdgesResult result;
  edges->run({MAQ_PIXEL_DEPTH16, kWidth, kHeight, {{rows.data(), kStride}, {}}}, camera_of(kWidth, kHeight), result);
  const maq::EdgesResult expected = run(*edges, metres, kWidth, kHeight);
  EXPECT_EQ(result.field.depth_m, metres);
  EXPECT_EQ(result.field.distance_r, expected.field.distance_r);
  EXPECT_EQ(result.field.kind, expected.field.kind);
}

TEST(Edges, OneThreadAndTwoAndReusedMemoryGiveTheSameField) {
  const auto one = tiny_edges::edges(1), two = tiny_edges::edges(2);
  maq::EdgesResult reused;
  for (const auto& [width, height] : {std::pair{100, 300}, {75, 133}, {100, 300}}) {
    const std::vector<float> depth = noise(width, height, 6);
    const maq::EdgesResult expected = run(*one, depth, width, height);
    for (int i = 0; i < 3; ++i) {
      two->run(view_of(depth, width, height), camera_of(width, height), reused);
      ASSERT_EQ(reused.field.distance_r, expected.field.distance_r);
      ASSERT_EQ(reused.field.expected_error_r, expected.field.expected_error_r);
      ASSERT_EQ(reused.field.kind, expected.field.kind);
    }
  }
}

TEST(Edges, TheScaleOfTheSceneIsWithoutEffect) {
  const auto edges = tiny_edges::edges();
  std::vector<float> depth;
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) depth.push_back(x > 20 && x < 50 && y > 25 ? 1.0f : 1.5f + 0.01f * float(x));
  }
  const maq::EdgesResult expected = run(*edges, depth, 80, 60);
  for (const float scale : {0.01f, 0.3f, 7.0f, 100.0f}) {
    std::vector<float> scaled = depth;
    for (float& z : scaled) z *= scale;
    const maq::EdgesResult result = run(*edges, scaled, 80, 60);
    for (size_t i = 0; i < depth.size(); ++i) {
      // This network has weights 100 times those of a trained one.
      ASSERT_NEAR(result.field.distance_r[i], expected.field.distance_r[i], 1e-2) << scale;
    }
  }
}

}  // namespace
