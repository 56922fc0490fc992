// A small residual added to large images of every format.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "image/convert.h"
#include "prediction/flow/image_residual.h"
#include "support/samples/moving_texture.h"

namespace {

TEST(ImageResidual, EveryFormatIsChangedAlike) {
  maq::ImageResidual residual;
  maq::WorkerThreads threads(2);
  std::vector<float> change(8 * 8 * 3);
  for (size_t i = 0; i < change.size(); ++i) change[i] = float(i % 3) * 8 - 10 + 12 * float(i / 24) / 8;
  for (const auto format :
       {MAQ_PIXEL_RGB8, MAQ_PIXEL_BGR8, MAQ_PIXEL_RGBA8, MAQ_PIXEL_GREY8, MAQ_PIXEL_NV12, MAQ_PIXEL_YUYV}) {
    // Odd sizes too, and smaller than the residual.
    for (const auto& [width, height] : {std::pair{160, 120}, {33, 17}, {5, 3}, {1, 1}}) {
      maq::Frame frame = moving_texture::frame(format, width, height, 3, 1, 0);
      maq::Frame before = moving_texture::frame(format, width, height, 3, 1, 0);
      residual.add(change.data(), 8, frame.image, threads, frame.storage.data());
      std::vector<uint8_t> one(size_t(width) * size_t(height) * 3), other(one.size());
      maq::copy_pixels(before.image, MAQ_PIXEL_BGR8, one.data(), 0, one.size());
      maq::copy_pixels(frame.image, MAQ_PIXEL_BGR8, other.data(), 0, other.size());
      double error = 0;
      for (int y = 0; y < height; ++y) {
        const float at_y = std::clamp((float(y) + 0.5f) * 8 / float(height) - 0.5f, 0.0f, 7.0f);
        for (int x = 0; x < width; ++x) {
          float rgb[3] = {-10 + 12 * at_y / 8, -2 + 12 * at_y / 8, 6 + 12 * at_y / 8};
          if (format == MAQ_PIXEL_GREY8) {
            rgb[0] = rgb[1] = rgb[2] = 0.299f * rgb[0] + 0.587f * rgb[1] + 0.114f * rgb[2];
          }
          for (int c = 0; c < 3; ++c) {
            const size_t i = (size_t(y) * size_t(width) + size_t(x)) * 3 + size_t(2 - c);
            const float sum = std::clamp(float(one[i]) + rgb[c], 0.0f, 255.0f);
            error += std::abs(double(float(other[i]) - sum)) / double(one.size());
          }
        }
      }
      EXPECT_LT(error, 1.6) << int(format) << " " << width;
    }
  }
}

TEST(ImageResidual, LessThanHalfALevelChangesNothingAndBytesDoNotOverflow) {
  maq::ImageResidual residual;
  maq::WorkerThreads threads(1);
  maq::Frame frame = moving_texture::frame(MAQ_PIXEL_BGR8, 160, 120, 6, 3, 0);
  const std::vector<uint8_t> before = frame.storage;
  const std::vector<float> little(64 * 64 * 3, 0.49f), much(64 * 64 * 3, 300.0f), less(64 * 64 * 3, -300.0f);
  residual.add(little.data(), 64, frame.image, threads, frame.storage.data());
  EXPECT_EQ(frame.storage, before);
  const auto expect_all = [&](uint8_t value) {
    for (size_t i = 0; i < 160 * 120 * 3; ++i) ASSERT_EQ(frame.storage[i], value) << i;
  };
  residual.add(much.data(), 64, frame.image, threads, frame.storage.data());
  expect_all(255);
  residual.add(less.data(), 64, frame.image, threads, frame.storage.data());
  expect_all(0);
}

}  // namespace
