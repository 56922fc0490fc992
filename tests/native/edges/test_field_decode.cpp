// From the network's output to distance, spread and kind.
#include "edges/field_decode.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/samples/tiny_edges.h"

namespace {

using maq::EdgeField;
using maq::FieldDecode;
using maq::FieldWindow;

using tiny_edges::kEps_r;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

EdgeField field_of(int width, int height) {
  EdgeField field;
  field.width = width;
  field.height = height;
  field.eps_r = kEps_r;
  const size_t pixels = size_t(width) * size_t(height);
  field.depth_m.assign(pixels, 1);
  field.distance_r.assign(pixels, -7);
  field.expected_error_r.assign(pixels, -7);
  field.kind.assign(pixels, 99);
  return field;
}

struct Answer {
  float distance, log_spread, crease, boundary;
};

// One cell of 2 x 2 pixels.
EdgeField decoded(const std::vector<Answer>& answers, int64_t* broken = nullptr) {
  EdgeField field = field_of(2, 2);
  float planes[FieldDecode::kChannels];
  for (size_t i = 0; i < 4; ++i) {
    const Answer& answer = answers[i];
    const float values[] = {answer.distance, answer.log_spread, answer.crease, answer.boundary};
    for (size_t c = 0; c < 4; ++c) planes[4 * c + i] = values[c];
  }
  maq::WorkerThreads threads(1);
  FieldDecode decode;
  const int64_t found = decode.write(planes, {0, 0, 2, 2}, threads, field);
  if (broken != nullptr) *broken = found;
  return field;
}

TEST(FieldDecode, DistancesAreInFootprintsAndCutOff) {
  const EdgeField field = decoded({{0.25f, 0, 1, 0}, {-0.5f, 0, 0, 1}, {1, 0, 1, 0}, {7, 0, 1, 0}});
  EXPECT_EQ(field.distance_r, (std::vector<float>{4, 0, kEps_r, kEps_r}));
  EXPECT_EQ(field.kind, (std::vector<uint8_t>{maq::kCreaseEdge, maq::kBoundaryEdge, maq::kNoEdge, maq::kNoEdge}));
}

TEST(FieldDecode, SpreadsAreExponentialsWithinTheLimitsOfTraining) {
  const EdgeField field = decoded({{0, 0, 0, 0}, {0, -3, 0, 0}, {0, -50, 0, 0}, {0, 50, 0, 0}});
  const double expected[] = {16, 16 * std::exp(-3.0), 16 * std::exp(-7.0), 16 * std::exp(1.0)};
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(field.expected_error_r[i] / expected[i], 1, 1e-6);
}

TEST(FieldDecode, WhatANetworkMayNotSayIsNoEdgeAndCounted) {
  int64_t broken = 0;
  const EdgeField field = decoded(
      {{kNan, kNan, kNan, kNan}, {kInfinity, kInfinity, 1, 0}, {-kInfinity, -kInfinity, kNan, 1}, {kNan, 0, 1, 0}},
      &broken);
  EXPECT_EQ(broken, 2);
  EXPECT_EQ(field.distance_r, (std::vector<float>{kEps_r, kEps_r, 0, kEps_r}));
  for (const float spread : field.expected_error_r) EXPECT_TRUE(std::isfinite(spread) && spread > 0);
  EXPECT_EQ(field.kind, (std::vector<uint8_t>{maq::kNoEdge, maq::kNoEdge, maq::kBoundaryEdge, maq::kNoEdge}));
}

// Each pixel has a number of its own as distance; windows may reach beyond the frame.
TEST(FieldDecode, EachPixelOfAWindowHasItsAnswerAndTheRestIsClear) {
  for (const FieldWindow& window : {FieldWindow{0, 0, 40, 72}, {4, 8, 20, 36}, {30, 60, 16, 16}, {0, 40, 40, 32}}) {
    std::vector<float> planes(size_t(window.width_px * window.height_px / 4 * FieldDecode::kChannels));
    const auto answer = [&](int x, int y) { return float((x * 31 + y * 17) % 1000) / 1000; };
    for (int y = 0; y < window.height_px; ++y) {
      for (int x = 0; x < window.width_px; ++x) {
        const size_t cell = size_t(y / 2 * (window.width_px / 2) + x / 2) * FieldDecode::kChannels;
        planes[cell + size_t(2 * (y % 2) + x % 2)] = answer(window.left_px + x, window.top_px + y);
      }
    }
    for (const int threads : {1, 2}) {
      EdgeField field = field_of(39, 71);
      field.depth_m[5 * 39 + 5] = field.depth_m[20 * 39 + 20] = 0;
      maq::WorkerThreads workers(threads);
      FieldDecode decode;
      decode.write(planes.data(), window, workers, field);
      maq::clear_outside(window, field);
      for (int y = 0; y < 71; ++y) {
        for (int x = 0; x < 39; ++x) {
          const size_t at = size_t(39 * y + x);
          const bool is_inside = x >= window.left_px && x < window.left_px + window.width_px && y >= window.top_px &&
                                 y < window.top_px + window.height_px;
          const bool has_answer = is_inside && field.depth_m[at] > 0;
          ASSERT_EQ(field.distance_r[at], has_answer ? answer(x, y) * kEps_r : kEps_r) << x << " " << y;
          ASSERT_EQ(field.expected_error_r[at], kEps_r);
          ASSERT_EQ(field.kind[at], has_answer ? maq::kCreaseEdge : maq::kNoEdge);
        }
      }
    }
  }
}

}  // namespace
