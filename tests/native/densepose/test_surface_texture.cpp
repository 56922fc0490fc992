// Textures of people from frames, and pixels from points of the surface.
#include "densepose/texture/surface_texture.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "densepose/texture/surface_lookup.h"

namespace {

constexpr int kSide = 64, kTile = 16;
constexpr size_t kRow = size_t(4) * 4 * kTile;

// A person who fills the image with part 8 (tile in column 1, row 1); U grows to the right, V upwards.
class SurfaceTexture : public testing::Test {
 protected:
  SurfaceTexture() {
    planes.reset(kSide, kSide);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const size_t at = size_t(y) * kSide + size_t(x);
        planes.person[at] = 1;
        planes.part[at] = 8;
        planes.u[at] = uint8_t(std::lround(255 * (x + 0.5) / kSide));
        planes.v[at] = uint8_t(std::lround(255 * (1 - (y + 0.5) / kSide)));
      }
    }
  }

  // RGB, red growing to the right and green downwards.
  void paint_slopes() {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) set(x, y, uint8_t(4 * x), uint8_t(4 * y), 50);
    }
  }
  void set(int x, int y, uint8_t red, uint8_t green, uint8_t blue) {
    uint8_t* const pixel = pixels.data() + 3 * (size_t(y) * kSide + size_t(x));
    pixel[0] = red, pixel[1] = green, pixel[2] = blue;
  }
  maq::ImageView image() const { return maq::packed_view(MAQ_PIXEL_RGB8, kSide, kSide, pixels.data()); }

  std::vector<uint8_t> drawn() const {
    std::vector<uint8_t> rgba(kRow * 6 * kTile, 7);
    texture.draw(rgba.data(), kRow);
    return rgba;
  }
  // R, G, B, A of a texel of the tile of `part`.
  static std::array<int, 4> texel(const std::vector<uint8_t>& rgba, int part, int x, int y) {
    const int column = (part - 1) / 6, row = (part - 1) % 6;
    const uint8_t* const at = rgba.data() + size_t(row * kTile + y) * kRow + 4 * size_t(column * kTile + x);
    return {at[0], at[1], at[2], at[3]};
  }

  maq::DensePlanes planes;
  std::vector<uint8_t> pixels = std::vector<uint8_t>(size_t(3) * kSide * kSide, 200);
  maq::SurfaceTexture texture{kTile};
};

TEST_F(SurfaceTexture, HasTheColoursOfTheFrameInTheTileOfThePart) {
  paint_slopes();
  EXPECT_EQ(texture.add(image(), planes, 1), int64_t(kSide) * kSide);
  const std::vector<uint8_t> rgba = drawn();
  for (int y = 1; y + 1 < kTile; ++y) {
    for (int x = 1; x + 1 < kTile; ++x) {
      const std::array<int, 4> found = texel(rgba, 8, x, y);
      EXPECT_NEAR(found[0], 4 * (4 * (x + 0.5) - 0.5), 2);  // four pixels a texel
      EXPECT_NEAR(found[1], 4 * (4 * (y + 0.5) - 0.5), 2);
      EXPECT_EQ(found[2], 50);
      EXPECT_GT(found[3], 200);  // some 16 pixels
    }
  }
  EXPECT_EQ(texel(rgba, 7, 8, 8), (std::array<int, 4>{128, 128, 128, 0}));  // never seen
}

TEST_F(SurfaceTexture, ConfidenceGrowsWithPixelsAndUnseenTexelsGetTheColoursAroundThem) {
  // One column of pixels in the middle, of a person on a background.
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) planes.person[size_t(y) * kSide + size_t(x)] = x >= 30 && x < 34 ? 1 : 0;
  }
  texture.add(image(), planes, 1);
  const std::vector<uint8_t> once = drawn();
  EXPECT_EQ(texel(once, 8, 0, 8), (std::array<int, 4>{200, 200, 200, 0}));
  const int alpha = texel(once, 8, 7, 8)[3];
  EXPECT_GT(alpha, 0);
  for (int frame = 0; frame < 5; ++frame) texture.add(image(), planes, 1);
  EXPECT_GT(texel(drawn(), 8, 7, 8)[3], alpha);
}

TEST_F(SurfaceTexture, LeavesOutTheOutlineAndOtherPeople) {
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      planes.person[size_t(y) * kSide + size_t(x)] = x < 32 ? 1 : 2;
      const bool is_near_border = x == 31 || x == 32;
      set(x, y, is_near_border ? 255 : 10, 10, 10);
    }
  }
  EXPECT_EQ(texture.add(image(), planes, 1), int64_t(31) * kSide);
  const std::vector<uint8_t> rgba = drawn();
  for (int y = 0; y < kTile; ++y) {
    for (int x = 0; x < kTile; ++x) EXPECT_EQ(texel(rgba, 8, x, y)[0], 10) << x << ", " << y;
  }
  EXPECT_EQ(texture.add(image(), planes, 3), 0);
}

TEST_F(SurfaceTexture, FollowsAChangeOfLight) {
  for (int frame = 0; frame < 30; ++frame) texture.add(image(), planes, 1);
  std::fill(pixels.begin(), pixels.end(), uint8_t(100));
  for (int frame = 0; frame < 30; ++frame) texture.add(image(), planes, 1);
  EXPECT_NEAR(texel(drawn(), 8, 8, 8)[0], 100, 2);
}

TEST_F(SurfaceTexture, AnyPlanesAreFine) {
  for (size_t i = 0; i < planes.part.size(); ++i) {
    planes.part[i] = uint8_t(i % 256);
    planes.u[i] = i % 2 != 0 ? 0 : 255;
    planes.v[i] = i % 3 != 0 ? 0 : 255;
  }
  EXPECT_LT(texture.add(image(), planes, 1), int64_t(kSide) * kSide);
  for (const int side : {2, 3, 17}) {
    maq::SurfaceTexture other(side);
    other.add(image(), planes, 1);
    std::vector<uint8_t> rgba(size_t(4) * size_t(other.width_px()) * size_t(other.height_px()), 7);
    other.draw(rgba.data(), size_t(4) * size_t(other.width_px()));
    EXPECT_EQ(rgba[2], 200);
  }
}

TEST_F(SurfaceTexture, PixelsAreFoundFromThePlanesValues) {
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(17, 40), std::pair(63, 63)}) {
    const size_t at = size_t(y) * kSide + size_t(x);
    const auto found = maq::find_surface_pixel(planes, 1, 8, float(planes.u[at]) / 255, float(planes.v[at]) / 255);
    ASSERT_TRUE(found);
    EXPECT_FLOAT_EQ(found->x_px, float(x) + 0.5f);
    EXPECT_FLOAT_EQ(found->y_px, float(y) + 0.5f);
    EXPECT_NEAR(found->distance, 0, 1e-6);
  }
  std::fill(planes.u.begin(), planes.u.end(), uint8_t(51));
  const auto middle = maq::find_surface_pixel(planes, 1, 8, 0.6f, 1);  // all of the first row is equally near
  ASSERT_TRUE(middle);
  EXPECT_FLOAT_EQ(middle->x_px, kSide / 2.0f);
  EXPECT_FLOAT_EQ(middle->y_px, 0.5f);
  EXPECT_NEAR(middle->distance, 0.4, 0.01);
  EXPECT_FALSE(maq::find_surface_pixel(planes, 1, 9, 0.5f, 0.5f));
  EXPECT_FALSE(maq::find_surface_pixel(planes, 2, 8, 0.5f, 0.5f));
}

}  // namespace
