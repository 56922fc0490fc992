// Hardware buffers as frames and as images to draw on, on an Android in memory.
#include <gtest/gtest.h>

#include <functional>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

#include "graphics/hardware_buffer.h"
#include "status_error.h"
#include "support/fakes/fake_ndk_graphics.h"

namespace {

using maq_jni::StatusError;

constexpr uint32_t kRgba = AHARDWAREBUFFER_FORMAT_R8G8B8A8_UNORM, kRgbx = AHARDWAREBUFFER_FORMAT_R8G8B8X8_UNORM,
                   kRgb = AHARDWAREBUFFER_FORMAT_R8G8B8_UNORM;

class HardwareBuffers : public ::testing::Test {
 protected:
  HardwareBuffers() {
    maq_yuv_image_init(&like_, sizeof like_);
    like_.timestamp_ns = 5;
    like_.sequence = 9;
  }
  void TearDown() override { EXPECT_EQ(fake_.misuse(), ""); }

  maquette::Frame frame(AHardwareBuffer* buffer) {
    return maquette::Frame(maq_jni::frame_of(android_, buffer, context_.get(), like_));
  }
  void expect_refused(AHardwareBuffer* buffer, maq_status status, const std::string& text, bool draws = false) {
    try {
      if (draws) {
        maq_jni::draw_on(android_, buffer, [](const maq_jni::Canvas&) { ADD_FAILURE() << "is drawn on"; });
      } else {
        frame(buffer);
      }
      ADD_FAILURE() << "is taken, not refused with: " << text;
    } catch (const StatusError& error) {
      EXPECT_EQ(error.status, status) << error.message;
      EXPECT_NE(error.message.find(text), std::string::npos) << error.message;
    }
    EXPECT_EQ(fake_.misuse(), "") << text;
  }

  const maquette::Context context_;
  FakeNdkGraphics fake_;
  maq_jni::GraphicsFunctions android_ = FakeNdkGraphics::functions();
  maq_yuv_image like_;
};

TEST_F(HardwareBuffers, PixelsOfColoursStayWhereTheyAreUntilTheFrameIsReleased) {
  for (const auto& [format, pixels, bytes] :
       {std::tuple(kRgba, MAQ_PIXEL_RGBA8, 4), std::tuple(kRgbx, MAQ_PIXEL_RGBA8, 4),
        std::tuple(kRgb, MAQ_PIXEL_RGB8, 3)}) {
    // Also for what is seldom read.
    for (const uint64_t usage : {uint64_t(2), AHARDWAREBUFFER_USAGE_CPU_READ_OFTEN | uint64_t(1) << 8}) {
      AHardwareBuffer* const buffer = fake_.make_buffer(format, 6, 4, usage);
      {
        const maquette::Frame taken = frame(buffer);
        const maq_frame_desc desc = taken.desc();
        EXPECT_EQ(desc.format, pixels);
        EXPECT_EQ(desc.width_px, 6);
        EXPECT_EQ(desc.height_px, 4);
        EXPECT_EQ(desc.planes[0], buffer->memory.data());
        EXPECT_EQ(desc.stride_bytes[0], size_t(14 * bytes));
        EXPECT_EQ(desc.timestamp_ns, 5);
        EXPECT_EQ(desc.sequence, 9u);
        EXPECT_EQ(desc.clock, MAQ_CLOCK_MONOTONIC);
        EXPECT_EQ(buffer->locks, 1);
        EXPECT_EQ(buffer->references, 2);
      }
      EXPECT_EQ(fake_.misuse(), "");
    }
  }
}

// Y, then U and V of the buffer's planes, as NV12 in memory of its own.
std::vector<uint8_t> nv12_of(const AHardwareBuffer& buffer, int width, int height) {
  std::vector<uint8_t> all;
  for (int y = 0; y < height; ++y) {
    const auto* row = static_cast<const uint8_t*>(buffer.planes[0].data) + size_t(y) * buffer.planes[0].rowStride;
    all.insert(all.end(), row, row + width);
  }
  for (int y = 0; y < (height + 1) / 2; ++y) {
    for (int x = 0; x < (width + 1) / 2; ++x) {
      for (const size_t plane : {1, 2}) {
        const AHardwareBuffer_Plane& of = buffer.planes[plane];
        all.push_back(static_cast<const uint8_t*>(of.data)[size_t(y) * of.rowStride + size_t(x) * of.pixelStride]);
      }
    }
  }
  return all;
}

TEST_F(HardwareBuffers, YuvIsCopiedUnlessItIsNv12InVideoRange) {
  constexpr int kWidth = 9, kHeight = 6;
  like_.is_video_range = 1;
  for (const auto& [step, u_at] : {std::pair(2u, 0u), std::pair(2u, 1u), std::pair(1u, 0u)}) {
    AHardwareBuffer* const buffer = fake_.make_yuv(kWidth, kHeight, step, u_at);
    const bool is_nv12 = step == 2 && u_at == 0;
    const maquette::Frame taken = frame(buffer);
    const maq_frame_desc desc = taken.desc();
    EXPECT_EQ(desc.format, MAQ_PIXEL_NV12);
    EXPECT_EQ(desc.planes[0] == buffer->memory.data(), is_nv12);
    EXPECT_EQ(buffer->locks, is_nv12 ? 1 : 0) << step << u_at;
    EXPECT_EQ(desc.timestamp_ns, 5);
    const std::vector<uint8_t> expected = nv12_of(*buffer, kWidth, kHeight);
    std::vector<uint8_t> found;
    for (int plane : {0, 1}) {
      for (int y = 0; y < (plane == 0 ? kHeight : kHeight / 2); ++y) {
        const uint8_t* row = desc.planes[plane] + size_t(y) * desc.stride_bytes[plane];
        found.insert(found.end(), row, row + (plane == 0 ? kWidth : kWidth + 1));
      }
    }
    EXPECT_EQ(found, expected) << step << u_at;
  }
  AHardwareBuffer* const nv12 = fake_.make_yuv(kWidth, kHeight, 2, 0);
  like_.rotation_deg = 90;
  EXPECT_EQ(frame(nv12).desc().width_px, kHeight);
  like_.rotation_deg = 0;
  like_.is_video_range = 0;
  const maquette::Frame scaled = frame(nv12);
  EXPECT_EQ(nv12->locks, 0);
  EXPECT_EQ(scaled.desc().planes[0][3], 16 + (nv12->memory[3] * 219 + 127) / 255);
}

TEST_F(HardwareBuffers, WhatTheCpuMayNotReadIsASentence) {
  const uint64_t gpu = uint64_t(1) << 8;
  expect_refused(fake_.make_buffer(kRgba, 6, 4, gpu), MAQ_ERROR_INVALID_ARGUMENT, "USAGE_CPU_READ_OFTEN");
  expect_refused(fake_.make_buffer(kRgba, 6, 4, AHARDWAREBUFFER_USAGE_CPU_WRITE_OFTEN), MAQ_ERROR_INVALID_ARGUMENT,
                 "The hardware buffer of 6 x 4 pixels is for the GPU alone");
  expect_refused(fake_.make_buffer(kRgba, 6, 4, AHARDWAREBUFFER_USAGE_PROTECTED_CONTENT | 3), MAQ_ERROR_UNSUPPORTED,
                 "protected content");
  AHardwareBuffer* const yuv = fake_.make_yuv(8, 8, 2, 1);
  yuv->desc.usage = gpu;
  expect_refused(yuv, MAQ_ERROR_INVALID_ARGUMENT, "USAGE_CPU_READ_OFTEN");
  AHardwareBuffer* const layered = fake_.make_buffer(kRgba, 6, 4);
  layered->desc.layers = 2;
  expect_refused(layered, MAQ_ERROR_UNSUPPORTED, "2 layers");
  for (const uint32_t format : {4u, 0x16u, 0x21u, 0x2bu, 0x36u, 0u}) {
    expect_refused(fake_.make_buffer(format, 6, 4), MAQ_ERROR_UNSUPPORTED, "the format " + std::to_string(format));
  }
  like_.rotation_deg = 90;
  expect_refused(fake_.make_buffer(kRgba, 6, 4), MAQ_ERROR_INVALID_ARGUMENT, "only YUV can be rotated");
}

TEST_F(HardwareBuffers, WhatADeviceSaysThatCannotBeIsNotRead) {
  AHardwareBuffer* const buffer = fake_.make_buffer(kRgba, 6, 4);
  for (const uint32_t stride : {0u, 5u, UINT32_MAX, 1u << 30}) {
    buffer->desc.stride = stride;
    expect_refused(buffer, MAQ_ERROR_UNREADABLE, "rows of " + std::to_string(stride) + " pixels");
  }
  buffer->desc.stride = 14;
  buffer->desc.width = UINT32_MAX;
  expect_refused(buffer, MAQ_ERROR_IMAGE_SIZE, "over the limit");
  buffer->desc.width = 0;
  expect_refused(buffer, MAQ_ERROR_IMAGE_SIZE, "0 x 4");
  AHardwareBuffer* const yuv = fake_.make_yuv(8, 8, 2, 1);
  const std::vector<AHardwareBuffer_Plane> good = yuv->planes;
  yuv->planes.pop_back();
  expect_refused(yuv, MAQ_ERROR_UNSUPPORTED, "2 planes");
  yuv->planes = good;
  yuv->planes[1].rowStride = UINT32_MAX;
  expect_refused(yuv, MAQ_ERROR_UNREADABLE, "strides that cannot be");
  yuv->planes = good;
  yuv->planes[2].rowStride = 3;
  expect_refused(yuv, MAQ_ERROR_INVALID_ARGUMENT, "rows 3 bytes apart");
  yuv->planes[2].data = nullptr;
  expect_refused(yuv, MAQ_ERROR_INVALID_ARGUMENT, "has no memory");
}

TEST_F(HardwareBuffers, FailuresOfAndroidLeaveNothing) {
  AHardwareBuffer* const rgba = fake_.make_buffer(kRgba, 6, 4);
  AHardwareBuffer* const yuv = fake_.make_yuv(8, 8, 2, 1);
  fake_.break_call("AHardwareBuffer_lock", -EIO);
  fake_.break_call("AHardwareBuffer_lockPlanes", -EBUSY);
  expect_refused(rgba, MAQ_ERROR_UNREADABLE, "cannot be locked: error -5");
  expect_refused(rgba, MAQ_ERROR_UNREADABLE, "cannot be locked: error -5", true);
  expect_refused(yuv, MAQ_ERROR_UNREADABLE, "cannot be locked: error -16");
  fake_.break_call("AHardwareBuffer_lock", -ENOMEM);
  expect_refused(rgba, MAQ_ERROR_OUT_OF_MEMORY, "no memory");
  android_.AHardwareBuffer_lockPlanes = nullptr;
  expect_refused(yuv, MAQ_ERROR_UNSUPPORTED, "Android 10");
}

TEST_F(HardwareBuffers, AreDrawnOnWhereTheyLie) {
  AHardwareBuffer* const buffer = fake_.make_buffer(kRgbx, 6, 4, uint64_t(2) << 4);
  maq_jni::draw_on(android_, buffer, [&](const maq_jni::Canvas& canvas) {
    EXPECT_EQ(canvas.rgba, buffer->memory.data());
    EXPECT_EQ(canvas.width_px, 6);
    EXPECT_EQ(canvas.height_px, 4);
    EXPECT_EQ(canvas.stride_bytes, 56u);
    EXPECT_EQ(canvas.size_bytes, 224u);
    EXPECT_EQ(buffer->locks, 1);
  });
  EXPECT_EQ(fake_.misuse(), "");
  EXPECT_THROW(maq_jni::draw_on(android_, buffer, [](const maq_jni::Canvas&) { throw 1; }), int);
  constexpr bool kDraws = true;
  expect_refused(fake_.make_buffer(kRgba, 6, 4, 3), MAQ_ERROR_INVALID_ARGUMENT, "USAGE_CPU_WRITE_OFTEN", kDraws);
  expect_refused(fake_.make_buffer(kRgb, 6, 4), MAQ_ERROR_UNSUPPORTED, "can be drawn on", kDraws);
}

TEST_F(HardwareBuffers, WithoutAndroidTheLibraryIsNamed) {
  try {
    maq_jni::graphics_functions();
    ADD_FAILURE();
  } catch (const StatusError& error) {
    EXPECT_EQ(error.status, MAQ_ERROR_RUNTIME_LIBRARY);
    EXPECT_NE(error.message.find("libnativewindow.so"), std::string::npos) << error.message;
  }
}

}  // namespace
