// A photo's light, from the part of a surface that the photo sees.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "head/texture/photo_light.h"

namespace photo_light_tests {
namespace {

using maq::Vec3;
using namespace maq::head;  // NOLINT

// Points of a ball with colours of their own, seen from one side.
struct Surface {
  std::vector<float> weights, own, differences, normals;

  template <class Light>
  Surface(int count, float darkest, float brightest, Light&& seen) {
    std::mt19937 random(5);
    std::normal_distribution<float> direction;
    std::uniform_real_distribution<float> level(darkest, brightest);
    for (int i = 0; i < count; ++i) {
      float normal[3];
      for (float& axis : normal) axis = direction(random);
      const float length = std::hypot(normal[0], normal[1], normal[2]);
      for (float& axis : normal) normals.push_back(axis /= length);
      weights.push_back(normal[1] < -0.3f ? 1.0f : 0.0f);
      for (size_t c = 0; c < 3; ++c) {
        own.push_back(level(random));
        differences.push_back(seen(own.back(), normal) - own.back());
      }
    }
  }

  PhotoLight fitted() const { return fit_photo_light(weights, own, differences, normals); }
};

TEST(PhotoLight, GainOffsetAndDirectionAreFoundFromTheSeenSide) {
  // f(own, normal) follows the model; levels as far apart as skin and hair.
  const Surface surface(4000, 20, 220, [](float own, const float* normal) {
    return 0.7f * own + 12 + own * (0.2f * normal[0] - 0.1f * normal[2]);
  });
  for (const ChannelLight& channel : surface.fitted()) {
    EXPECT_NEAR(channel.gain, 0.7, 0.03);
    EXPECT_NEAR(channel.offset, 12, 4);
    EXPECT_NEAR(channel.directed.x, 0.2, 0.04);
    EXPECT_NEAR(channel.directed.z, -0.1, 0.03);
    const float behind[] = {0.6f, 0.8f, 0};
    EXPECT_NEAR(channel(100, behind), 94, 5) << "a side that the photo does not see";
  }
}

TEST(PhotoLight, OneColourInUniformLightIsAPlainGain) {
  const Surface surface(500, 80, 80, [](float, const float*) { return 120.0f; });
  for (const ChannelLight& channel : surface.fitted()) {
    EXPECT_NEAR(channel.gain, 1.5, 0.1);
    const float behind[] = {0, 1, 0};
    EXPECT_NEAR(channel(80, behind), 120, 1);
    EXPECT_GT(channel(200, behind), 230) << "brighter parts get brighter alike";
  }
}

TEST(PhotoLight, NothingSeenChangesNothingAndColoursStayInTheirRange) {
  Surface surface(300, 0, 255, [](float own, const float*) { return 3 * own; });
  const float up[] = {0, 0, 1};
  for (const ChannelLight& channel : surface.fitted()) {
    EXPECT_LE(channel(255, up), 255);
    EXPECT_GE(channel(0, up), 0);
  }
  surface.weights.assign(300, 0);
  for (const ChannelLight& channel : surface.fitted()) {
    for (const float own : {0.0f, 100.0f, 255.0f}) EXPECT_EQ(channel(own, up), own);
  }
  for (const ChannelLight& channel : fit_photo_light({}, {}, {}, {})) EXPECT_EQ(channel(7, up), 7);
}

TEST(PhotoLight, BlackOverexposedAndOnePointAreFinite) {
  for (const float shown : {0.0f, 255.0f}) {
    for (const int count : {1, 3, 400}) {
      for (const float own : {0.0f, 255.0f}) {
        const Surface surface(count, own, own, [&](float, const float*) { return shown; });
        const float side[] = {1, 0, 0};
        for (const ChannelLight& channel : surface.fitted()) EXPECT_TRUE(std::isfinite(channel(own, side)));
      }
    }
  }
}

}  // namespace
}  // namespace photo_light_tests
