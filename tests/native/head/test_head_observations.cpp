// The encoder's cells in the photo's pixels.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "head/fit/observations.h"
#include "support/expect_error.h"

namespace head_observations {
namespace {

using namespace maq::head;  // NOLINT

TEST(HeadObservations, CellsLieWhereTheCropDoesAndNormalsTurnWithIt) {
  std::vector<float> cells(4 * kCellChannels, 0.0f);
  for (size_t i = 0; i < 4; ++i) {
    float* cell = &cells[i * kCellChannels];
    cell[0] = 0.5f, cell[3] = std::log(0.05f), cell[4] = 2, cell[5] = 3, cell[7] = -4;
  }
  maq::AffineMap map;  // a quarter turn, twice as large
  map.xx = 0, map.xy = -2, map.yx = 2, map.yy = 0, map.shift_x = 100, map.shift_y = 10;
  const HeadObservations seen = read_observations(cells.data(), {2, 4}, map);
  ASSERT_EQ(seen.cells.size(), 4u);
  EXPECT_EQ(seen.unusable, 0u);
  EXPECT_NEAR(seen.cell_px, 8, 1e-12);
  // Cell (0, 1): the crop's pixel centre (5.5, 1.5), continuous (6, 2).
  EXPECT_NEAR(seen.cells[1].x_px, 100 - 4 - 0.5, 1e-12);
  EXPECT_NEAR(seen.cells[1].y_px, 10 + 12 - 0.5, 1e-12);
  EXPECT_NEAR(seen.cells[1].sigma_dm, 0.05, 1e-7);
  EXPECT_NEAR(seen.cells[1].matte, 1 / (1 + std::exp(-2.0)), 1e-7);
  const maq::Point back = seen.photo_to_crop({96, 22});
  EXPECT_NEAR(back.x, 6, 1e-12);
  EXPECT_NEAR(back.y, 2, 1e-12);
}

TEST(HeadObservations, WhatIsNotFiniteFarAwayOrOutsideThePhotoIsNotUsed) {
  std::vector<float> cells(9 * kCellChannels, 0.5f);
  cells[0 * kCellChannels + 2] = NAN;
  cells[1 * kCellChannels + 4] = INFINITY;
  cells[2 * kCellChannels + 7] = -INFINITY;
  cells[3 * kCellChannels + 0] = 17;
  cells[4 * kCellChannels + 3] = 1e30f;
  cells[5 * kCellChannels + 3] = -1e30f;
  const HeadObservations seen = read_observations(cells.data(), {3, 4}, {}, 100, 8);
  for (const size_t i : {0u, 1u, 2u, 3u, 6u, 7u, 8u}) {
    EXPECT_FALSE(seen.cells[i].is_usable) << i;
    EXPECT_EQ(seen.cells[i].matte, 0) << i;
  }
  EXPECT_EQ(seen.unusable, 7u);
  EXPECT_NEAR(seen.cells[4].sigma_dm, 3, 0.01);
  EXPECT_NEAR(seen.cells[5].sigma_dm, 0.01, 1e-3);
  for (const double value : {0.0, -1.0, std::nan(""), double(INFINITY)}) {
    maq::AffineMap map;
    map.xx = value;
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "rotation", [&] { read_observations(cells.data(), {3, 4}, map); });
  }
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "0 cells", [&] { read_observations(cells.data(), {0, 4}, {}); });
}

}  // namespace
}  // namespace head_observations
