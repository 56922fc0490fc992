// Displacements kept in half of their memory.
#include "prediction/flow/packed_flow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace {

TEST(PackedFlow, KeepsDisplacementsToA65534thOfTheLargestAndWhatStandsStill) {
  maq::FlowField flow, found;
  flow.resize(20, 15);
  std::mt19937 random(3);
  for (std::vector<float>* all : {&flow.dx_px, &flow.dy_px}) {
    for (float& value : *all) value = float(int(random() % 4001) - 2000) / 100;
  }
  flow.dx_px[7] = -40;
  flow.dx_px[8] = flow.dy_px[9] = 0;
  maq::PackedFlow packed;
  EXPECT_TRUE(packed.pack(flow));
  packed.unpack(found);
  ASSERT_EQ(found.width_px, 20);
  ASSERT_EQ(found.height_px, 15);
  for (size_t i = 0; i < flow.dx_px.size(); ++i) {
    EXPECT_NEAR(found.dx_px[i], flow.dx_px[i], 40.0 / 65534 + 1e-5) << i;
    EXPECT_NEAR(found.dy_px[i], flow.dy_px[i], 40.0 / 65534 + 1e-5) << i;
  }
  EXPECT_EQ(found.dx_px[8], 0);
  EXPECT_EQ(found.dy_px[9], 0);
  for (const float all : {0.0f, 1e-38f}) {  // too small to be kept: no NaN
    std::fill(flow.dx_px.begin(), flow.dx_px.end(), all);
    std::fill(flow.dy_px.begin(), flow.dy_px.end(), -all);
    EXPECT_EQ(packed.pack(flow), all > 0);
    packed.unpack(found);
    for (size_t i = 0; i < flow.dx_px.size(); ++i) EXPECT_TRUE(found.dx_px[i] == 0 && found.dy_px[i] == 0) << i;
  }
}

}  // namespace
