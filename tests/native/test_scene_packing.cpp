#include <gtest/gtest.h>

#include "scene/scene_packing.h"

namespace {
TEST(ScenePacking, Builds) {
  maq::ModelledPoints p;
  p.x = p.y = p.z = {1.0f};
  p.means.resize(8);
  p.slopes.resize(48);
  p.variations.resize(1);
  p.views.resize(1);
  EXPECT_EQ(maq::make_scene(p, {}).points, 1u);
}
}  // namespace
