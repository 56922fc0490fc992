#include <gtest/gtest.h>

#include <cstdint>
#include <maquette/maquette.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/picture_files.h"
#include "support/temp_folder.h"

namespace {

maq_frame_desc desc_of(const std::vector<uint8_t>& pixels, int width, int height) {
  maq_frame_desc desc;
  maq_frame_desc_init(&desc, sizeof desc);
  desc.format = MAQ_PIXEL_RGB8;
  desc.width_px = width;
  desc.height_px = height;
  desc.planes[0] = pixels.data();
  return desc;
}

TEST(ApiFrames, WrapMemoryOfTheAppWithoutACopy) {
  const maquette::Context context;
  const std::vector<uint8_t> pixels(5 * 32);
  maq_frame_desc desc = desc_of(pixels, 10, 5);
  desc.stride_bytes[0] = 32;
  desc.timestamp_ns = 123;
  desc.clock = MAQ_CLOCK_MONOTONIC;
  desc.sequence = 9;
  const maquette::Frame frame(context, desc);
  const maq_frame_desc back = frame.desc();
  EXPECT_EQ(back.planes[0], pixels.data());
  EXPECT_EQ(back.stride_bytes[0], 32u);
  EXPECT_EQ(back.width_px, 10);
  EXPECT_EQ(back.timestamp_ns, 123);
  EXPECT_EQ(back.clock, MAQ_CLOCK_MONOTONIC);
  EXPECT_EQ(back.sequence, 9u);
}

std::string bytes_of_photo() { return read_text(std::string(MAQ_TEST_MEDIA) + "/photo.jpg"); }

TEST(ApiFrames, AreDecodedFromMemoryAsFromAFile) {
  const maquette::Context context;
  const TempFolder folder;
  const std::string photo = bytes_of_photo();
  const maquette::Frame frame = maquette::Frame::decode(context, photo.data(), photo.size());
  const maq_frame_desc desc = frame.desc();
  EXPECT_EQ(desc.format, MAQ_PIXEL_BGR8);
  EXPECT_EQ(desc.timestamp_ns, 0);
  EXPECT_EQ(desc.clock, MAQ_CLOCK_MEDIA);
  EXPECT_EQ(rgb_of(frame), read_rgb(context, std::string(MAQ_TEST_MEDIA) + "/photo.jpg"));
  frame.save(folder.file("a.png"));
  const std::string png = read_text(folder.file("a.png"));
  EXPECT_EQ(rgb_of(maquette::Frame::decode(context, png.data(), png.size())), rgb_of(frame));
}

TEST(ApiFrames, AreNotDecodedFromWhatIsNoWholeImage) {
  const maquette::Context context;
  const std::string photo = bytes_of_photo();
  maq_frame* frame = nullptr;
  const auto decode = [&](const std::string& bytes) {
    return maq_frame_decode(context.get(), bytes.data(), bytes.size(), &frame);
  };
  EXPECT_EQ(decode(photo.substr(0, photo.size() / 2)), MAQ_ERROR_UNREADABLE);
  EXPECT_STREQ(maq_last_error(context.get()),
               "The image in memory is truncated: the end of the JPEG image is missing; copy it again.");
  EXPECT_EQ(decode(""), MAQ_ERROR_UNREADABLE);
  EXPECT_EQ(decode("no image"), MAQ_ERROR_UNREADABLE);
  EXPECT_EQ(decode("GIF89a" + std::string(100, '\0')), MAQ_ERROR_UNSUPPORTED);
  EXPECT_EQ(maq_frame_decode(context.get(), nullptr, photo.size(), &frame), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(frame, nullptr);
}

TEST(ApiFrames, CallTheAppBackOnceWhenReleased) {
  const maquette::Context context;
  const std::vector<uint8_t> pixels(300);
  int freed = 0;
  const auto count = [](void* user_data) { ++*static_cast<int*>(user_data); };
  maq_frame_desc desc = desc_of(pixels, 10, 10);
  maq_frame* frame = nullptr;
  ASSERT_EQ(maq_frame_wrap(context.get(), &desc, count, &freed, &frame), MAQ_OK);
  EXPECT_EQ(freed, 0);
  maq_frame_release(frame);
  EXPECT_EQ(freed, 1);
  desc.width_px = 0;
  EXPECT_EQ(maq_frame_wrap(context.get(), &desc, count, &freed, &frame), MAQ_ERROR_IMAGE_SIZE);
  EXPECT_EQ(freed, 1) << "a frame that was not made is not freed";
}

TEST(ApiFrames, ACallbackThatThrowsEndsNothingAndIsTold) {
  const maquette::Context context;
  const std::vector<uint8_t> pixels(300);
  const maq_frame_desc desc = desc_of(pixels, 10, 10);
  maq_frame* frame = nullptr;
  const auto throw_error = [](void*) { throw std::runtime_error("The app's own error."); };
  ASSERT_EQ(maq_frame_wrap(context.get(), &desc, throw_error, nullptr, &frame), MAQ_OK);
  maq_frame_release(frame);
  EXPECT_STREQ(
      maq_last_error(nullptr),
      "maq_frame_release: release_callback threw an exception (The app's own error.); functions that the library "
      "calls must not.");
  ASSERT_EQ(maq_frame_wrap(
                context.get(), &desc, [](void*) { throw 5; }, nullptr, &frame),
            MAQ_OK);
  maq_frame_release(frame);
  EXPECT_STREQ(maq_last_error(nullptr),
               "maq_frame_release: release_callback threw an exception; functions that the library calls must not.");
}

TEST(ApiFrames, OutliveTheirContextAndSource) {
  std::optional<maquette::Frame> frame;
  {
    const maquette::Context context;
    maquette::Source source(context, "stub:pattern?size=32x24");
    frame = source.next();
  }
  std::vector<uint8_t> pixels(32 * 24 * 3);
  frame->copy_pixels(MAQ_PIXEL_RGB8, pixels.data(), 0, pixels.size());
  EXPECT_EQ(pixels[0], 191);
}

TEST(ApiFrames, WrongDescriptionsAreStatusesOfTheContext) {
  const maquette::Context context;
  const std::vector<uint8_t> pixels(300);
  const auto status_of = [&](auto change) {
    maq_frame_desc desc = desc_of(pixels, 10, 10);
    change(desc);
    try {
      maquette::Frame(context, desc);
      return MAQ_OK;
    } catch (const maquette::Error& error) {
      EXPECT_STREQ(error.what(), maq_last_error(context.get()));
      return error.status();
    }
  };
  EXPECT_EQ(status_of([](auto&) {}), MAQ_OK);
  EXPECT_EQ(status_of([](auto& desc) { desc.planes[0] = nullptr; }), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(status_of([](auto& desc) { desc.stride_bytes[0] = 29; }), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(status_of([](auto& desc) { desc.width_px = 20000; }), MAQ_ERROR_IMAGE_SIZE);
  EXPECT_EQ(status_of([](auto& desc) { desc.height_px = -1; }), MAQ_ERROR_IMAGE_SIZE);
  EXPECT_EQ(status_of([](auto& desc) { desc.format = maq_pixel_format(0); }), MAQ_ERROR_UNSUPPORTED);
  EXPECT_EQ(status_of([](auto& desc) { desc.format = maq_pixel_format(9); }), MAQ_ERROR_UNSUPPORTED);
  EXPECT_EQ(status_of([](auto& desc) { desc.clock = maq_clock(3); }), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(status_of([](auto& desc) { desc.struct_size = 0; }), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST(ApiFrames, OfDepthAreTheirOwnDepthImageAndHaveNoColours) {
  const maquette::Context context;
  const std::vector<uint8_t> pixels(3 * 48);
  for (const auto& [format, row] : {std::pair{MAQ_PIXEL_DEPTH16, 20}, {MAQ_PIXEL_DEPTH32F, 40}}) {
    maq_frame_desc desc = desc_of(pixels, 10, 3);
    desc.format = format;
    EXPECT_EQ(maquette::Frame(context, desc).desc().stride_bytes[0], size_t(row));
    desc.stride_bytes[0] = 48;
    const maquette::Frame frame(context, desc);
    const std::optional<maq_frame_desc> depth = frame.depth();
    ASSERT_TRUE(depth);
    EXPECT_EQ(depth->format, format);
    EXPECT_EQ(depth->planes[0], pixels.data());
    EXPECT_EQ(depth->stride_bytes[0], 48u);
    std::vector<uint8_t> rgb(90);
    EXPECT_EQ(maq_frame_copy_pixels(frame.get(), MAQ_PIXEL_RGB8, rgb.data(), 0, rgb.size()), MAQ_ERROR_UNSUPPORTED);
    desc.stride_bytes[0] = size_t(row) - 1;
    maq_frame* refused = nullptr;
    EXPECT_EQ(maq_frame_wrap(context.get(), &desc, nullptr, nullptr, &refused), MAQ_ERROR_INVALID_ARGUMENT);
  }
}

// Bytes from the first row to the end of the last, modulo the largest number, are few for each of them.
TEST(ApiFrames, AreNotCopiedWithAStrideWhoseSizeWraps) {
  const maquette::Context context;
  maquette::Source source(context, "stub:pattern?size=16x9");
  const std::optional<maquette::Frame> frame = source.next();
  const std::vector<uint8_t> untouched(16 * 9 * 4, 0xA5);
  for (const size_t stride :
       {SIZE_MAX, SIZE_MAX - 15, SIZE_MAX / 2, SIZE_MAX / 2 + 1, SIZE_MAX / 4 + 1, SIZE_MAX / 8 + 1, SIZE_MAX / 8}) {
    for (const maq_pixel_format format : {MAQ_PIXEL_RGB8, MAQ_PIXEL_BGR8, MAQ_PIXEL_RGBA8, MAQ_PIXEL_GREY8}) {
      for (const size_t size : {untouched.size(), SIZE_MAX}) {
        std::vector<uint8_t> pixels = untouched;
        EXPECT_EQ(maq_frame_copy_pixels(frame->get(), format, pixels.data(), stride, size), MAQ_ERROR_INVALID_ARGUMENT)
            << stride;
        EXPECT_NE(std::string(maq_last_error(frame->get())).find("stride_bytes is " + std::to_string(stride)),
                  std::string::npos)
            << maq_last_error(frame->get());
        ASSERT_EQ(pixels, untouched);
      }
    }
  }
}

TEST(ApiFrames, AreNotWrappedWithRowsThatAreInNoMemory) {
  const maquette::Context context;
  const std::vector<uint8_t> pixels(300);
  const auto expect_refused = [&](const char* what, auto change) {
    maq_frame_desc desc = desc_of(pixels, 10, 9);
    change(desc);
    maq_frame* frame = nullptr;
    EXPECT_EQ(maq_frame_wrap(context.get(), &desc, nullptr, nullptr, &frame), MAQ_ERROR_INVALID_ARGUMENT) << what;
    EXPECT_NE(std::string(maq_last_error(nullptr)).find(what), std::string::npos) << maq_last_error(nullptr);
  };
  // The last: no rows are that long, and codecs of files count with 31 bits.
  for (const size_t stride : {SIZE_MAX, SIZE_MAX / 2 + 1, SIZE_MAX / 8 + 1, size_t(1) << 31}) {
    expect_refused("desc.stride_bytes[0] is ", [&](auto& desc) { desc.stride_bytes[0] = stride; });
  }
  expect_refused("desc.stride_bytes[1] is ", [&](auto& desc) {
    desc.format = MAQ_PIXEL_NV12;
    desc.planes[1] = pixels.data();
    desc.stride_bytes[1] = SIZE_MAX / 4 + 1;
  });
  expect_refused("desc.stride_bytes[0] is 30", [](auto& desc) {
    desc.planes[0] = reinterpret_cast<const uint8_t*>(UINTPTR_MAX - 100);
    desc.stride_bytes[0] = 30;
  });
}

TEST(ApiFrames, AreResized) {
  const maquette::Context context;
  maquette::Source source(context, "stub:pattern?size=60x40&frames=2&fps=10");
  source.next();
  const std::optional<maquette::Frame> frame = source.next();
  std::vector<uint8_t> pixels(60 * 40 * 3), small(20 * 10 * 3);
  frame->copy_pixels(MAQ_PIXEL_BGR8, pixels.data(), 0, pixels.size());
  const maquette::Frame resized = frame->resized(20, 10);
  EXPECT_EQ(resized.desc().format, MAQ_PIXEL_BGR8);
  EXPECT_EQ(resized.desc().timestamp_ns, frame->desc().timestamp_ns);
  EXPECT_EQ(resized.desc().sequence, 1u);
  resized.copy_pixels(MAQ_PIXEL_BGR8, small.data(), 0, small.size());
  for (size_t i = 0; i < small.size(); ++i) {
    const size_t c = i % 3, x = i / 3 % 20 * 3, y = i / 60 * 4;
    int sum = 0;
    for (size_t k = 0; k < 12; ++k) sum += pixels[((y + k / 3) * 60 + x + k % 3) * 3 + c];
    ASSERT_NEAR(small[i], sum / 12.0, 1) << i;
  }
  EXPECT_EQ(frame->resized(120, 90).desc().width_px, 120);
  maq_frame* none = nullptr;
  EXPECT_EQ(maq_frame_resize(frame->get(), 0, 10, &none), MAQ_ERROR_IMAGE_SIZE);
}

// 4 x 2 pixels, with V before U in one plane, as phones have it, and its description.
struct PhoneImage {
  PhoneImage() {
    maq_yuv_image_init(&desc, sizeof desc);
    desc.width_px = 4;
    desc.height_px = 2;
    const uint8_t* planes[] = {luma.data(), vu.data() + 1, vu.data()};
    const size_t sizes[] = {luma.size(), vu.size() - 1, vu.size() - 1};
    for (int i = 0; i < 3; ++i) {
      desc.planes[i] = planes[i];
      desc.size_bytes[i] = sizes[i];
      desc.stride_bytes[i] = i == 0 ? 5 : 4;
      desc.pixel_stride_bytes[i] = i == 0 ? 1 : 2;
    }
  }
  std::vector<uint8_t> luma = {0, 51, 102, 153, 99, 204, 255, 128, 64};
  std::vector<uint8_t> vu = {255, 0, 128, 64};
  maq_yuv_image desc;
};

std::vector<uint8_t> nv12_of(const maquette::Frame& frame) {
  const maq_frame_desc desc = frame.desc();
  EXPECT_EQ(desc.format, MAQ_PIXEL_NV12);
  EXPECT_EQ(desc.planes[1], desc.planes[0] + 8);
  return {desc.planes[0], desc.planes[0] + 12};
}

TEST(ApiFrames, AreMadeOfImagesInPlanesInEitherRangeAndRotated) {
  using Bytes = std::vector<uint8_t>;
  const maquette::Context context;
  PhoneImage image;
  EXPECT_EQ(image.desc.clock, MAQ_CLOCK_MONOTONIC);
  image.desc.timestamp_ns = 7;
  image.desc.sequence = 3;
  const maquette::Frame full = maquette::Frame::convert_yuv(context, image.desc);
  EXPECT_EQ(nv12_of(full), (Bytes{16, 60, 104, 147, 191, 235, 126, 71, 16, 240, 72, 128}));
  EXPECT_EQ(full.desc().timestamp_ns, 7);
  EXPECT_EQ(full.desc().sequence, 3u);
  EXPECT_EQ(full.desc().clock, MAQ_CLOCK_MONOTONIC);
  image.desc.is_video_range = 1;
  EXPECT_EQ(nv12_of(maquette::Frame::convert_yuv(context, image.desc)),
            (Bytes{0, 51, 102, 153, 204, 255, 128, 64, 0, 255, 64, 128}));
  image.desc.rotation_deg = 90;
  const maquette::Frame upright = maquette::Frame::convert_yuv(context, image.desc);
  EXPECT_EQ(upright.desc().width_px, 2);
  EXPECT_EQ(upright.desc().height_px, 4);
  EXPECT_EQ(nv12_of(upright), (Bytes{204, 0, 255, 51, 128, 102, 64, 153, 0, 255, 64, 128}));
  image.desc.rotation_deg = 180;
  EXPECT_EQ(nv12_of(maquette::Frame::convert_yuv(context, image.desc)),
            (Bytes{64, 128, 255, 204, 153, 102, 51, 0, 64, 128, 0, 255}));
}

TEST(ApiFrames, AreNotMadeOfPlanesThatCannotBe) {
  const maquette::Context context;
  const auto expect_refused = [&](const char* what, maq_status status, auto change) {
    PhoneImage image;
    change(image.desc);
    maq_frame* frame = nullptr;
    EXPECT_EQ(maq_frame_convert_yuv(context.get(), &image.desc, &frame), status) << what;
    EXPECT_NE(std::string(maq_last_error(nullptr)).find(what), std::string::npos) << maq_last_error(nullptr);
    EXPECT_EQ(frame, nullptr);
  };
  const maq_status invalid = MAQ_ERROR_INVALID_ARGUMENT;
  expect_refused("plane Y of an image of 4 x 2 pixels needs 9 bytes, but has 8", invalid,
                 [](auto& image) { image.size_bytes[0] = 8; });
  expect_refused("plane V of an image of 4 x 2 pixels needs 3 bytes, but has 2", invalid,
                 [](auto& image) { image.size_bytes[2] = 2; });
  expect_refused("plane U of an image of 4 x 2 pixels has no memory", invalid,
                 [](auto& image) { image.planes[1] = nullptr; });
  expect_refused("rows 3 bytes apart", invalid, [](auto& image) { image.stride_bytes[0] = 3; });
  expect_refused("rows -5 bytes apart", invalid, [](auto& image) { image.stride_bytes[0] = -5; });
  expect_refused("pixels 2 bytes apart", invalid, [](auto& image) { image.pixel_stride_bytes[0] = 2; });
  expect_refused("pixels 0 bytes apart", invalid, [](auto& image) { image.pixel_stride_bytes[1] = 0; });
  expect_refused("needs", invalid, [](auto& image) {
    image.stride_bytes[1] = image.pixel_stride_bytes[1] = INT32_MAX;
    image.width_px = 2;
    image.height_px = 4;
  });
  expect_refused("image.rotation_deg is 45", invalid, [](auto& image) { image.rotation_deg = 45; });
  expect_refused("image.rotation_deg is -90", invalid, [](auto& image) { image.rotation_deg = -90; });
  expect_refused("image.is_video_range is 2", invalid, [](auto& image) { image.is_video_range = 2; });
  expect_refused("image.clock is 0", invalid, [](auto& image) { image.clock = maq_clock(0); });
  expect_refused("image.struct_size", invalid, [](auto& image) { image.struct_size -= 1; });
  expect_refused("The image is 0 x 2", MAQ_ERROR_IMAGE_SIZE, [](auto& image) { image.width_px = 0; });
  expect_refused("The image is 4 x 2147483647", MAQ_ERROR_IMAGE_SIZE, [](auto& image) { image.height_px = INT32_MAX; });
}

}  // namespace
