// Images of results: people over their frame, and alone.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

#include "support/picture_files.h"

namespace {

constexpr int kWidth = 320, kHeight = 256;

// A person (make_tiny_bundle.py: of a red cell) in an image of many colours.
class ApiDrawing : public ::testing::Test {
 protected:
  ApiDrawing() { maq_densepose_drawing_init(&drawing_, sizeof drawing_); }

  int opacity() const {
    return drawing_.opacity == 0 ? 180 : drawing_.opacity == MAQ_DENSEPOSE_INVISIBLE ? 0 : drawing_.opacity;
  }

  // The expected colour at a pixel of the frame, by definition.
  std::vector<uint8_t> expected(int x, int y, bool has_frame) const {
    size_t stride = 0;
    const uint8_t part = result_.plane(MAQ_DENSEPOSE_PLANE_PART, &stride)[size_t(y) * stride + size_t(x)];
    const double covers = part == 0 ? 0 : opacity() / 255.0;
    uint8_t colour[3];
    maq_densepose_get_part_colour(part, colour);
    std::vector<uint8_t> rgba;
    for (int c = 0; c < 3; ++c) {
      const double under = has_frame ? shown_[(size_t(y) * kWidth + size_t(x)) * 3 + size_t(c)] : 0;
      rgba.push_back(uint8_t(std::lround(under * (1 - covers) + colour[c] * covers)));
    }
    rgba.push_back(has_frame ? 255 : uint8_t(std::lround(255 * covers)));
    return rgba;
  }

  // Draws the part that drawing_ asks for and compares each pixel; what lies between the rows stays.
  void expect_drawn(const maquette::Frame* frame) {
    const int width = drawing_.width_px == 0 ? kWidth - drawing_.x_px : drawing_.width_px;
    const int height = drawing_.height_px == 0 ? kHeight - drawing_.y_px : drawing_.height_px;
    const size_t row = size_t(width) * 4, stride = row + 12;
    std::vector<uint8_t> rgba(stride * size_t(height - 1) + row, 77);
    result_.draw(frame, drawing_, rgba.data(), stride, rgba.size());
    int wrong = 0;
    for (int y = 0; y < height; ++y) {
      const uint8_t* pixel = rgba.data() + size_t(y) * stride;
      for (int i = 0; i < width; ++i, pixel += 4) {
        const int x = drawing_.is_mirrored == 1 ? width - 1 - i : i;
        const std::vector<uint8_t> wanted = expected(drawing_.x_px + x, drawing_.y_px + y, frame != nullptr);
        wrong += !std::equal(wanted.begin(), wanted.end(), pixel);
      }
      for (size_t i = row; i < stride && y + 1 < height; ++i) wrong += rgba[size_t(y) * stride + i] != 77;
    }
    EXPECT_EQ(wrong, 0) << width << " x " << height << " at " << drawing_.x_px << ", " << drawing_.y_px;
  }

  maq_status drawn(const maquette::Frame* frame, size_t stride, size_t bytes, std::string* text = nullptr) {
    std::vector<uint8_t> rgba(bytes);
    return status_of([&] { result_.draw(frame, drawing_, rgba.data(), stride, bytes); }, text);
  }

  // Dark: nothing else is red.
  std::vector<uint8_t> dark_picture() {
    std::vector<uint8_t> pixels = speckled(kWidth, kHeight);
    for (uint8_t& value : pixels) value /= 8;
    return pixels;
  }

  const maquette::Context context_;
  std::vector<uint8_t> pixels_ = dark_picture();
  maquette::DensePose densepose_{context_, MAQ_TEST_DATA "/tiny_bundle"};
  maq_densepose_drawing drawing_;
  const maquette::Frame frame_ = [this] {
    for (int y = 100; y < 104; ++y) {
      for (int x = 80; x < 84; ++x) pixels_[size_t(y * kWidth + x) * 3] = 255;
    }
    return maquette::Frame(context_, describe(MAQ_PIXEL_RGB8, pixels_, kWidth, kHeight));
  }();
  const maquette::DensePoseResult result_ = densepose_.run(frame_);
  std::vector<uint8_t> shown_ = pixels_;
};

TEST_F(ApiDrawing, PeopleAreBlendedWithTheColoursOfTheirParts) {
  ASSERT_GT(result_.stats().body_pixel_count, 500);
  EXPECT_EQ(drawing_.opacity, 0);
  for (const int opacity : {0, MAQ_DENSEPOSE_INVISIBLE, 1, 128, 255}) {
    drawing_.opacity = opacity;
    expect_drawn(&frame_);
    expect_drawn(nullptr);
  }
}

TEST_F(ApiDrawing, AnyPartOfTheFrameIsDrawnAndMirrored) {
  for (const int is_mirrored : {0, 1}) {
    drawing_.is_mirrored = is_mirrored;
    for (const auto& [x, y, width, height] :
         {std::tuple(0, 0, 0, 0), std::tuple(61, 83, 77, 51), std::tuple(80, 96, 1, 1), std::tuple(79, 15, 0, 0),
          std::tuple(319, 255, 1, 1), std::tuple(1, 1, 318, 17)}) {
      drawing_.x_px = x;
      drawing_.y_px = y;
      drawing_.width_px = width;
      drawing_.height_px = height;
      expect_drawn(&frame_);
    }
  }
}

TEST_F(ApiDrawing, FramesOfEveryFormatAreDrawn) {
  // NV12, of which two pixels of two rows share their colour.
  std::vector<uint8_t> luma(size_t(kWidth) * kHeight), chroma(luma.size() / 2);
  for (size_t i = 0; i < luma.size(); ++i) luma[i] = uint8_t(16 + i * 7 % 220);
  for (size_t i = 0; i < chroma.size(); ++i) chroma[i] = uint8_t(16 + i * 13 % 224);
  maq_frame_desc desc = describe(MAQ_PIXEL_NV12, luma, kWidth, kHeight);
  desc.planes[1] = chroma.data();
  const maquette::Frame frame(context_, desc);
  shown_ = rgb_of(frame);
  for (const int at : {0, 1, 33}) {
    drawing_.x_px = drawing_.y_px = at;
    drawing_.width_px = 101;
    expect_drawn(&frame);
  }
  drawing_.x_px = drawing_.y_px = drawing_.width_px = 0;
  const maquette::Frame depth(context_,
                              describe(MAQ_PIXEL_DEPTH16, std::vector<uint8_t>(luma.size() * 2), kWidth, kHeight));
  EXPECT_EQ(drawn(&depth, 0, luma.size() * 4), MAQ_ERROR_UNSUPPORTED);
}

TEST_F(ApiDrawing, WhatCannotBeDrawnIsASentence) {
  std::string text;
  constexpr size_t kRow = size_t(kWidth) * 4, kAll = kRow * kHeight;
  EXPECT_EQ(drawn(&frame_, kRow, kAll), MAQ_OK);
  EXPECT_EQ(drawn(&frame_, 0, kAll - 1, &text), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text.find("size_bytes is 327679"), std::string::npos) << text;
  EXPECT_EQ(drawn(&frame_, kRow - 1, kAll, &text), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(drawn(&frame_, SIZE_MAX, kAll, &text), MAQ_ERROR_INVALID_ARGUMENT);
  const std::vector<uint8_t> small(12);
  const maquette::Frame other(context_, describe(MAQ_PIXEL_RGB8, small, 2, 2));
  EXPECT_EQ(drawn(&other, 0, kAll, &text), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text.find("frame has 2 x 2 pixels, but result is of a frame of 320 x 256"), std::string::npos) << text;
  const auto expect_refused = [&](const char* what, auto change) {
    const maq_densepose_drawing before = drawing_;
    change(drawing_);
    EXPECT_EQ(drawn(&frame_, 0, kAll, &text), MAQ_ERROR_INVALID_ARGUMENT) << what;
    EXPECT_NE(text.find(what), std::string::npos) << text;
    drawing_ = before;
  };
  constexpr char kOutside[] = "not inside the frame of 320 x 256";
  expect_refused(kOutside, [](auto& drawing) { drawing.x_px = 320; });
  expect_refused(kOutside, [](auto& drawing) { drawing.y_px = -1; });
  expect_refused(kOutside, [](auto& drawing) { drawing.x_px = INT32_MIN; });
  expect_refused(kOutside, [](auto& drawing) { drawing.width_px = 321; });
  expect_refused(kOutside, [](auto& drawing) { drawing.height_px = -1; });
  expect_refused(kOutside, [](auto& drawing) { drawing.x_px = drawing.width_px = INT32_MAX; });
  expect_refused("drawing.opacity is 256", [](auto& drawing) { drawing.opacity = 256; });
  expect_refused("drawing.is_mirrored is 2", [](auto& drawing) { drawing.is_mirrored = 2; });
  expect_refused("drawing.colours is 3", [](auto& drawing) { drawing.colours = maq_densepose_colours(3); });
  expect_refused("drawing.struct_size", [](auto& drawing) { drawing.struct_size = 4; });
  EXPECT_EQ(maq_densepose_result_draw(result_.get(), nullptr, nullptr, nullptr, 0, kAll), MAQ_ERROR_INVALID_ARGUMENT);
}

}  // namespace
