// Colours of people by regions of the body.
#include "densepose/tracking/surface_colours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace {

TEST(SurfaceColours, AreTheSameInAllPixelFormats) {
  maq::DensePlanes planes;
  planes.reset(64, 64);
  std::fill(planes.part.begin(), planes.part.end(), uint8_t(2));
  std::fill(planes.person.begin(), planes.person.end(), uint8_t(1));
  const auto colours = [&](maq_pixel_format format, std::vector<uint8_t> first, std::vector<uint8_t> second) {
    std::vector<uint8_t> plane, chroma;
    const size_t pixels = format == MAQ_PIXEL_YUYV ? 64 * 32 : 64 * 64;
    for (size_t i = 0; i < pixels; ++i) plane.insert(plane.end(), first.begin(), first.end());
    for (size_t i = 0; i < size_t(32) * 32; ++i) chroma.insert(chroma.end(), second.begin(), second.end());
    std::vector<maq::SurfaceColours> read;
    maq::read_colours({format, 64, 64, {{plane.data(), plane.size() / 64}, {chroma.data(), chroma.size() / 32}}},
                      planes, 1, read);
    return read.at(0);
  };
  // Y 110, Cb 90, Cr 180 in full range.
  const maq::SurfaceColours rgb = colours(MAQ_PIXEL_RGB8, {183, 86, 43}, {});
  for (const maq::SurfaceColours& other :
       {colours(MAQ_PIXEL_BGR8, {43, 86, 183}, {}), colours(MAQ_PIXEL_RGBA8, {183, 86, 43, 9}, {}),
        colours(MAQ_PIXEL_NV12, {110}, {90, 180}), colours(MAQ_PIXEL_YUYV, {110, 90, 110, 180}, {})}) {
    const maq::ColourDifference look = maq::difference(rgb, other);
    EXPECT_LT(look.distance, 0.03f);
    EXPECT_GT(look.shared, 0.2f);
  }
  EXPECT_GT(maq::difference(rgb, colours(MAQ_PIXEL_RGB8, {40, 60, 180}, {})).distance, 0.5f);
  EXPECT_EQ(maq::difference(rgb, {}).shared, 0);
}

TEST(SurfaceColours, OldColoursFadeSlowly) {
  maq::SurfaceColours known, seen;
  seen.regions[4] = {{100, 128, 128}, 50};
  for (int frame = 0; frame < 30; ++frame) known.add(seen);
  EXPECT_EQ(known.regions[4].samples, maq::SurfaceColours::kMaxSamples);
  seen.regions[4].colour[0] = 200;
  known.add(seen);
  EXPECT_NEAR(known.regions[4].colour[0], 100 + 100 * 50 / 1050.0f, 0.01f);
}

}  // namespace
