#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "densepose/surface/surface_grid.h"
#include "support/expect_error.h"

namespace {

// 24 parts of 2 x 2 nodes; the value of number i is 100 * i, from (-1, 0, 1) to (1, 2, 5) metres.
std::vector<uint8_t> made_up() {
  std::vector<uint8_t> bytes(40 + 24 * 4 * 6);
  std::memcpy(bytes.data(), "MAQGRID1", 8);
  const uint32_t counts[] = {24, 2};
  const float box_m[] = {-1, 0, 1, 1, 2, 5};
  std::memcpy(&bytes[8], counts, sizeof counts);
  std::memcpy(&bytes[16], box_m, sizeof box_m);
  for (size_t i = 0; i < 24 * 4 * 3; ++i) {
    const auto value = uint16_t(100 * i);
    std::memcpy(&bytes[40 + 2 * i], &value, 2);
  }
  return bytes;
}

template <class Number>
std::vector<uint8_t> changed(size_t offset, Number number) {
  std::vector<uint8_t> bytes = made_up();
  std::memcpy(&bytes[offset], &number, sizeof number);
  return bytes;
}

void expect_refused(const std::vector<uint8_t>& bytes, const std::string& text) {
  // A copy of exact size, so that a read past its end is seen by AddressSanitizer.
  const std::vector<uint8_t> exact(bytes.begin(), bytes.end());
  expect_error(MAQ_ERROR_BAD_BUNDLE, text, [&] { maq::decode_surface_grid(exact, "a.grid"); });
}

TEST(SurfaceGrid, PointsLieBetweenTheCornersOfItsBox) {
  const maq::SurfaceGrid grid = maq::decode_surface_grid(made_up(), "a.grid");
  ASSERT_EQ(grid.nodes, 2);
  ASSERT_EQ(grid.points_m.size(), 24u * 4 * 3);
  EXPECT_FLOAT_EQ(grid.points_m[0], -1);
  EXPECT_FLOAT_EQ(grid.points_m[1], 100.0f / 65534 * 2);
  EXPECT_FLOAT_EQ(grid.points_m[2], 1 + 200.0f / 65534 * 4);
  EXPECT_FLOAT_EQ(grid.points_m[287], 1 + 28700.0f / 65534 * 4);
  const maq::SurfaceGrid full = maq::decode_surface_grid(changed(40, uint16_t(65534)), "a.grid");
  EXPECT_FLOAT_EQ(full.points_m[0], 1) << "the largest value is the highest corner";
}

TEST(SurfaceGrid, APointWithOneMissingCoordinateIsOutsideTheChart) {
  for (const size_t axis : {0u, 1u, 2u}) {
    const maq::SurfaceGrid grid = maq::decode_surface_grid(changed(40 + 6 + 2 * axis, uint16_t(65535)), "a.grid");
    EXPECT_FALSE(std::isnan(grid.points_m[2]));
    for (size_t i = 3; i < 6; ++i) EXPECT_TRUE(std::isnan(grid.points_m[i]));
    EXPECT_FALSE(std::isnan(grid.points_m[6]));
  }
}

TEST(SurfaceGrid, OtherBytesAreRefused) {
  expect_refused({}, "not a surface grid");
  expect_refused(changed(7, '2'), "not a surface grid");
  expect_refused(changed(8, uint32_t(23)), "23 parts");
  expect_refused(changed(8, uint32_t(0)), "0 parts");
  // 24 * 2^31 * 2^31 * 6 is 0 in 64 bits.
  for (const uint32_t nodes : {0u, 1u, 3u, 0x80000000u, 0xFFFFFFFFu})
    expect_refused(changed(12, nodes), "nodes a side");
  expect_refused(changed(16, 2.0f), "reaches from 2 to 1 m");
  expect_refused(changed(16, std::nanf("")), "reaches from");
  expect_refused(changed(36, std::nanf("")), "reaches from");
  expect_refused(changed(36, HUGE_VALF), "reaches from");
  expect_refused(changed(16, -HUGE_VALF), "reaches from");
}

TEST(SurfaceGrid, TruncatedAnywhereOrLongerItIsRefused) {
  const std::vector<uint8_t> whole = made_up();
  for (size_t length = 0; length < whole.size(); ++length) {
    expect_refused({whole.begin(), whole.begin() + std::ptrdiff_t(length)}, "surface grid");
  }
  std::vector<uint8_t> longer = whole;
  longer.push_back(0);
  expect_refused(longer, "surface grid");
}

}  // namespace
