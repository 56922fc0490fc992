// Textures of people and look-ups of the surface through the C API.
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

#include "support/picture_files.h"
#include "support/temp_folder.h"

namespace {

class ApiTextures : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const maquette::Context context;
    maquette::DensePose densepose(context, MAQ_TEST_MODELS "/densepose-b-int8");
    maquette::Source source(context, "image:" MAQ_TEST_MEDIA "/photo.jpg");
    frame_ = new maquette::Frame(std::move(*source.next()));
    result_ = new maquette::DensePoseResult(densepose.run(*frame_));
  }
  static void TearDownTestSuite() {
    delete result_;
    delete frame_;
  }

  static maquette::Frame* frame_;
  static maquette::DensePoseResult* result_;
  const maquette::Context context;
};
maquette::Frame* ApiTextures::frame_ = nullptr;
maquette::DensePoseResult* ApiTextures::result_ = nullptr;

TEST_F(ApiTextures, APhotoFillsPartsOfTheImage) {
  maquette::DensePoseTexture texture(context);
  EXPECT_EQ(texture.size_px(), (std::array<int32_t, 2>{256, 384}));
  const auto seen = [&] {
    const std::vector<uint8_t> rgba = texture.draw();
    int count = 0;
    for (size_t i = 3; i < rgba.size(); i += 4) count += rgba[i] > 0;
    return double(count) / double(rgba.size() / 4);
  };
  EXPECT_EQ(seen(), 0);
  texture.add_person(*result_, 0, *frame_);
  EXPECT_GT(seen(), 0.04);  // the photo shows one side, a third of the charts' tiles
  EXPECT_LT(seen(), 0.5);

  const TempFolder folder;
  const std::string path = (folder.path() / "person.png").string();
  texture.save(path);
  maquette::Source saved(context, "image:" + path);
  EXPECT_EQ(saved.next()->desc().width_px, 256);
  EXPECT_THROW(texture.save((folder.path() / "person.jpg").string()), maquette::Error);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "person.jpg"));
  EXPECT_THROW(texture.save("/nonexistent/person.png"), maquette::Error);
}

TEST_F(ApiTextures, PixelsOfPointsAreInThePlanes) {
  size_t stride = 0;
  const uint8_t* const part = result_->plane(MAQ_DENSEPOSE_PLANE_PART, &stride);
  const uint8_t* const u = result_->plane(MAQ_DENSEPOSE_PLANE_U, &stride);
  const uint8_t* const v = result_->plane(MAQ_DENSEPOSE_PLANE_V, &stride);
  const uint8_t* const person = result_->plane(MAQ_DENSEPOSE_PLANE_PERSON, &stride);
  int tried = 0;
  for (size_t at = 0; at < stride * size_t(result_->height_px()); at += 997) {
    if (person[at] != 1) continue;
    const auto found = maquette::find_pixel(*result_, 0, part[at], float(u[at]) / 255, float(v[at]) / 255);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->distance, 0, 1e-6);
    ++tried;
  }
  EXPECT_GT(tried, 20);
}

TEST_F(ApiTextures, WhatIsWrongIsASentence) {
  std::string text;
  EXPECT_EQ(status_of([&] { maquette::DensePoseTexture(context, 7); }, &text), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(text, "maq_densepose_texture_create: config.tile_px is 7, but must be 8 to 512.");
  EXPECT_EQ(status_of([&] { maquette::DensePoseTexture(context, 513); }, &text), MAQ_ERROR_INVALID_ARGUMENT);
  maquette::DensePoseTexture texture(context, 8);
  EXPECT_EQ(status_of([&] { texture.add_person(*result_, 99, *frame_); }, &text), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text.find("index is 99"), std::string::npos) << text;
  const std::vector<uint8_t> pixels = speckled(64, 48);
  const maquette::Frame other(context, describe(MAQ_PIXEL_RGB8, pixels, 64, 48));
  EXPECT_EQ(status_of([&] { texture.add_person(*result_, 0, other); }, &text), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text.find("frame has 64 x 48 pixels"), std::string::npos) << text;
  std::vector<uint8_t> rgba(32 * 48 * 4);
  EXPECT_EQ(maq_densepose_texture_draw(texture.get(), rgba.data(), 0, rgba.size()), MAQ_OK);
  EXPECT_EQ(maq_densepose_texture_draw(texture.get(), rgba.data(), 0, rgba.size() - 1), MAQ_ERROR_INVALID_ARGUMENT);

  float pixel[2];
  const auto find = [&](uint32_t index, int32_t part, float u, float v) {
    return maq_densepose_result_find_pixel(result_->get(), index, part, u, v, pixel, nullptr);
  };
  EXPECT_EQ(find(99, 1, 0, 0), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(find(0, 0, 0, 0), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(find(0, 25, 0, 0), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(find(0, 2, -0.1f, 0), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(find(0, 2, 0, std::numeric_limits<float>::quiet_NaN()), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(find(0, 2, 0.5f, 0.5f), MAQ_OK);
}

}  // namespace
