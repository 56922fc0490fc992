// Results on a window of Android, on an Android in memory: images, failures, and windows that go while they are
// drawn.
#include <gtest/gtest.h>

#include <atomic>
#include <maquette/maquette.hpp>
#include <thread>
#include <vector>

#include "graphics/preview.h"
#include "status_error.h"
#include "support/fakes/fake_ndk_graphics.h"

namespace {

using maq_jni::PreviewStyle;
using maq_jni::Scaling;

constexpr int kWidth = 320, kHeight = 256;
constexpr uint32_t kBlack = 0xff000000;

class Preview : public ::testing::Test {
 protected:
  void TearDown() override {
    preview_.set_window(nullptr, 0, 0);
    EXPECT_EQ(fake_.misuse(), "");
  }

  // Pixels that differ from their neighbours.
  static std::vector<uint8_t> pixels() {
    std::vector<uint8_t> rgb(size_t(kWidth) * kHeight * 3);
    for (size_t i = 0; i < rgb.size(); ++i) rgb[i] = uint8_t(i % 251 / 8 + i / 960 % 7);
    for (int y = 100; y < 104; ++y) {
      for (int x = 80; x < 84; ++x) rgb[size_t(y * kWidth + x) * 3] = 255;  // a person to the tiny networks
    }
    return rgb;
  }
  static maq_frame_desc describe(const std::vector<uint8_t>& rgb) {
    maq_frame_desc desc;
    maq_frame_desc_init(&desc, sizeof desc);
    desc.format = MAQ_PIXEL_RGB8;
    desc.width_px = kWidth;
    desc.height_px = kHeight;
    desc.planes[0] = rgb.data();
    return desc;
  }

  ANativeWindow* open(int width, int height) {
    ANativeWindow* const window = fake_.make_window();
    preview_.set_window(window, width, height);
    return window;
  }
  bool draw(const PreviewStyle& style = {}) { return preview_.draw(frame_.get(), result_.get(), style); }

  // The C API's drawing of a part of the frame.
  std::vector<uint32_t> drawn(int x, int y, int width, int height, const PreviewStyle& style) {
    maq_densepose_drawing drawing;
    maq_densepose_drawing_init(&drawing, sizeof drawing);
    drawing.x_px = x;
    drawing.y_px = y;
    drawing.width_px = width;
    drawing.height_px = height;
    drawing.opacity = style.opacity == 0 ? MAQ_DENSEPOSE_INVISIBLE : style.opacity;
    drawing.is_mirrored = style.is_mirrored ? 1 : 0;
    std::vector<uint32_t> rgba(size_t(width) * size_t(height));
    result_.draw(&frame_, drawing, reinterpret_cast<uint8_t*>(rgba.data()), 0, rgba.size() * 4);
    return rgba;
  }

  const maquette::Context context_;
  maquette::DensePose densepose_{context_, MAQ_TEST_DATA "/tiny_bundle"};
  const std::vector<uint8_t> rgb_ = pixels();
  const maquette::Frame frame_{context_, describe(rgb_)};
  const maquette::DensePoseResult result_ = densepose_.run(frame_);
  FakeNdkGraphics fake_;
  const maq_jni::GraphicsFunctions android_ = FakeNdkGraphics::functions();
  maq_jni::Preview preview_{android_};
};

TEST_F(Preview, TheWholeFrameIsShownBetweenBarsInTheWindowsProportions) {
  ASSERT_FALSE(result_.people().empty());
  const struct {
    int window_width, window_height, width, height;
  } table[] = {{640, 512, 320, 256}, {1080, 1920, 320, 569}, {1920, 1080, 455, 256}, {64, 51, 321, 256},
               {1, 1, 320, 320},     {5000, 1, 2560, 256},   {1, 5000, 320, 2048},   {INT32_MAX, INT32_MAX, 320, 320}};
  for (const bool is_mirrored : {false, true}) {
    const PreviewStyle style{Scaling::kFit, 99, is_mirrored};
    const std::vector<uint32_t> picture = drawn(0, 0, kWidth, kHeight, style);
    for (const auto& row : table) {
      ANativeWindow* const window = open(row.window_width, row.window_height);
      ASSERT_TRUE(draw(style));
      const FakeNdkGraphics::Picture shown = fake_.shown(window);
      ASSERT_EQ(shown.width, row.width) << row.window_width;
      ASSERT_EQ(shown.height, row.height) << row.window_height;
      const int left = (row.width - kWidth) / 2, top = (row.height - kHeight) / 2;
      int wrong = 0;
      for (int y = 0; y < row.height; ++y) {
        for (int x = 0; x < row.width; ++x) {
          const bool is_bar = x < left || x >= left + kWidth || y < top || y >= top + kHeight;
          const uint32_t expected = is_bar ? kBlack : picture[size_t((y - top) * kWidth + x - left)];
          wrong += shown.pixels[size_t(y * row.width + x)] != expected;
        }
      }
      EXPECT_EQ(wrong, 0) << row.window_width << " x " << row.window_height;
    }
  }
}

TEST_F(Preview, TheMiddleOfTheFrameFillsTheWindow) {
  const struct {
    int window_width, window_height, x, y, width, height;
  } table[] = {{640, 512, 0, 0, 320, 256},
               {1080, 1920, 88, 0, 144, 256},
               {1920, 1080, 0, 38, 320, 180},
               {1, 5000, 159, 0, 1, 256},
               {5000, 1, 0, 127, 320, 1}};
  for (const bool is_mirrored : {false, true}) {
    const PreviewStyle style{Scaling::kFill, 180, is_mirrored};
    for (const auto& row : table) {
      ANativeWindow* const window = open(row.window_width, row.window_height);
      ASSERT_TRUE(draw(style));
      const FakeNdkGraphics::Picture shown = fake_.shown(window);
      ASSERT_EQ(shown.width, row.width) << row.window_width;
      ASSERT_EQ(shown.height, row.height) << row.window_height;
      EXPECT_EQ(shown.pixels, drawn(row.x, row.y, row.width, row.height, style)) << row.window_width;
    }
  }
}

TEST_F(Preview, AWindowOfAnotherSizeOrStyleGetsOtherBuffers) {
  ANativeWindow* const window = fake_.make_window();
  preview_.set_window(window, 640, 512);
  EXPECT_TRUE(draw());
  EXPECT_TRUE(draw());
  EXPECT_EQ(fake_.shown(window).posts, 2);
  ++window->references;  // of who sets it
  preview_.set_window(window, 512, 640);
  EXPECT_TRUE(draw());
  EXPECT_EQ(fake_.shown(window).height, 400);
  EXPECT_TRUE(draw({Scaling::kFill, 180, false}));
  EXPECT_EQ(fake_.shown(window).height, 256);
}

TEST_F(Preview, WithoutAWindowNothingIsDrawn) {
  EXPECT_FALSE(draw());
  ANativeWindow* const window = open(640, 512);
  EXPECT_TRUE(draw());
  preview_.set_window(nullptr, 0, 0);
  fake_.take_away(window);
  EXPECT_FALSE(draw());
  open(0, 512);
  EXPECT_FALSE(draw());
}

TEST_F(Preview, FailuresOfTheWindowLoseAPictureAndNothingElse) {
  ANativeWindow* const window = open(640, 512);
  for (const char* name : {"ANativeWindow_setBuffersGeometry", "ANativeWindow_lock", "ANativeWindow_unlockAndPost"}) {
    ++window->references;
    preview_.set_window(window, 640, 512);
    fake_.break_call(name, -EINVAL, 0, 1);
    EXPECT_FALSE(draw()) << name;
    EXPECT_TRUE(draw()) << name;
    EXPECT_EQ(fake_.misuse(), "a window is kept; ") << name;  // it is the preview's
  }
  for (const bool have_no_memory : {false, true}) {
    fake_.give_other_buffers(1, have_no_memory);
    EXPECT_FALSE(draw());
    EXPECT_TRUE(draw());
    EXPECT_EQ(fake_.shown(window).width, 320);
  }
}

TEST_F(Preview, WhatCannotBeDrawnLeavesTheWindowUnlocked) {
  ANativeWindow* const window = open(640, 512);
  const std::vector<uint8_t> small(12);
  maq_frame_desc desc = describe(small);
  desc.width_px = desc.height_px = 2;
  const maquette::Frame other(context_, desc);
  EXPECT_THROW(preview_.draw(other.get(), result_.get(), {}), maq_jni::StatusError);
  EXPECT_THROW(draw({Scaling::kFit, 256, false}), maq_jni::StatusError);
  EXPECT_FALSE(window->is_locked);
  EXPECT_TRUE(draw());
}

TEST_F(Preview, WindowsGoAndComeWhileOthersDraw) {
  std::atomic<bool> is_over{false};
  std::atomic<int> pictures{0};
  std::vector<std::thread> threads;
  for (const Scaling scaling : {Scaling::kFit, Scaling::kFill}) {
    threads.emplace_back([this, scaling, &is_over, &pictures] {
      while (!is_over) pictures += draw({scaling, 180, false}) ? 1 : 0;
    });
  }
  for (int i = 0; i < 60; ++i) {
    ANativeWindow* const window = open(100 + i % 7 * 40, 200);
    const int before = pictures;
    while (i % 3 == 0 && pictures == before) std::this_thread::yield();
    preview_.set_window(nullptr, 0, 0);
    fake_.take_away(window);  // surfaceDestroyed() has returned: nothing may use it
  }
  is_over = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_GE(pictures, 20);
}

}  // namespace
