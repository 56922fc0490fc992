// Images and results as files: what is in them, and that they are whole or not there.
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "support/file_size_limit.h"
#include "support/picture_files.h"
#include "support/temp_folder.h"

namespace {

class ApiSaving : public ::testing::Test {
 protected:
  // 320 x 256, black but for one red cell, at (left, 100): one person (make_tiny_bundle.py).
  static std::vector<uint8_t> one_person(int left = 80) {
    std::vector<uint8_t> pixels(320 * 256 * 3);
    for (int y = 100; y < 104; ++y) {
      for (int x = left; x < left + 4; ++x) pixels[size_t(y * 320 + x) * 3] = 255;
    }
    return pixels;
  }

  maquette::DensePoseResult result_of(const std::vector<uint8_t>& pixels, int width, int height) {
    maquette::DensePose densepose(context_, MAQ_TEST_DATA "/tiny_bundle");
    return densepose.run(maquette::Frame(context_, describe(MAQ_PIXEL_RGB8, pixels, width, height)));
  }

  void expect_refused(const maquette::Frame& frame, const std::string& path, maq_status status,
                      const std::string& part_of_text) {
    std::string text;
    EXPECT_EQ(status_of([&] { frame.save(path); }, &text), status) << path;
    EXPECT_NE(text.find(part_of_text), std::string::npos) << text;
  }

  maquette::Context context_;
  TempFolder folder_;
};

// The colour type in the head of a PNG file: 0 grey, 2 RGB.
int colour_type(const std::string& path) { return read_text(path).at(25); }

TEST_F(ApiSaving, APngHasTheVeryPixelsOfEveryFormatInColour) {
  const int width = 33, height = 17;
  const std::vector<uint8_t> rgb = speckled(width, height);
  std::vector<uint8_t> bgr = rgb, rgba, padded(size_t(height) * 128, 7);
  for (size_t i = 0; i < rgb.size(); i += 3) {
    std::swap(bgr[i], bgr[i + 2]);
    rgba.insert(rgba.end(), {rgb[i], rgb[i + 1], rgb[i + 2], uint8_t(i)});
  }
  for (size_t y = 0; y < size_t(height); ++y) std::copy_n(&rgb[y * 99], 99, &padded[y * 128]);
  const maq_frame_desc all[] = {
      describe(MAQ_PIXEL_RGB8, rgb, width, height), describe(MAQ_PIXEL_RGB8, padded, width, height, 128),
      describe(MAQ_PIXEL_BGR8, bgr, width, height), describe(MAQ_PIXEL_RGBA8, rgba, width, height)};
  for (const maq_frame_desc& desc : all) {
    const std::string path = folder_.file("a.png");
    maquette::Frame(context_, desc).save(path);
    EXPECT_EQ(read_rgb(context_, path), rgb) << desc.format;
    EXPECT_EQ(colour_type(path), 2) << "no alpha, which frames do not have";
  }
  EXPECT_EQ(files_in(folder_.path()), 1u);
}

TEST_F(ApiSaving, AGreyPictureStaysGrey) {
  const std::vector<uint8_t> grey = speckled(16, 17);
  maquette::Frame(context_, describe(MAQ_PIXEL_GREY8, grey, 15, 17, 16)).save(folder_.file("a.png"));
  EXPECT_EQ(colour_type(folder_.file("a.png")), 0);
  const std::vector<uint8_t> read = read_rgb(context_, folder_.file("a.png"));
  for (size_t y = 0; y < 17; ++y) {
    for (size_t x = 0; x < 15; ++x) ASSERT_EQ(read[(y * 15 + x) * 3 + 1], grey[y * 16 + x]) << x << ' ' << y;
  }
}

TEST_F(ApiSaving, FramesOfCamerasHaveTheColoursThatAnAppSees) {
  for (const maq_pixel_format format : {MAQ_PIXEL_NV12, MAQ_PIXEL_YUYV}) {
    const std::vector<uint8_t> pixels = speckled(40, 40);
    maq_frame_desc desc = describe(format, pixels, 31, 19);
    if (format == MAQ_PIXEL_NV12) desc.planes[1] = pixels.data() + 31 * 19;
    const maquette::Frame frame(context_, desc);
    frame.save(folder_.file("a.png"));
    EXPECT_EQ(read_rgb(context_, folder_.file("a.png")), rgb_of(frame)) << format;
  }
}

TEST_F(ApiSaving, AJpegIsNearThePicture) {
  std::vector<uint8_t> smooth(64 * 48 * 3);
  for (size_t i = 0; i < smooth.size(); ++i) smooth[i] = uint8_t(2 * (i / 3 % 64) + 50 * (i % 3));
  const maquette::Frame frame(context_, describe(MAQ_PIXEL_RGB8, smooth, 64, 48));
  for (const char* name : {"a.jpg", "a.jpeg", "b.JPG"}) {
    frame.save(folder_.file(name));
    EXPECT_EQ(read_text(folder_.file(name)).substr(0, 2), "\xff\xd8") << name;
    const std::vector<uint8_t> read = read_rgb(context_, folder_.file(name));
    ASSERT_EQ(read.size(), smooth.size());
    for (size_t i = 0; i < read.size(); ++i) ASSERT_NEAR(read[i], smooth[i], 12) << name << ' ' << i;
  }
}

TEST_F(ApiSaving, OtherEndingsAreRefusedAndNothingIsWritten) {
  const std::vector<uint8_t> pixels = speckled(4, 4);
  const maquette::Frame frame(context_, describe(MAQ_PIXEL_RGB8, pixels, 4, 4));
  for (const char* name : {"a.gif", "a", "a.png.txt", "a.png/", ".png"}) {
    expect_refused(frame, folder_.file(name), MAQ_ERROR_INVALID_ARGUMENT, "ends neither in .png nor in .jpg");
  }
  expect_refused(frame, "", MAQ_ERROR_INVALID_ARGUMENT, "ends neither in .png nor in .jpg");
  EXPECT_EQ(files_in(folder_.path()), 0u);
  EXPECT_EQ(maq_frame_save(frame.get(), nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(maq_last_error(frame.get()), "maq_frame_save: path is NULL.");
}

TEST_F(ApiSaving, DepthIsWrittenAsDepthAndReadAgain) {
  std::vector<uint8_t> pixels(8 * 8 * 2);
  for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = uint8_t(i * 3);
  const maquette::Frame frame(context_, describe(MAQ_PIXEL_DEPTH16, pixels, 8, 8));
  frame.save(folder_.file("a.png"));
  frame.save(folder_.file("a.tiff"));
  const auto read = [&](const std::string& uri) {
    const std::optional<maquette::Frame> back = maquette::Source(context_, "image:" + folder_.file(uri)).next();
    const std::optional<maq_frame_desc> desc = back->depth();
    const uint8_t* begin = desc->planes[0];
    return std::pair(desc->format, std::vector<uint8_t>(begin, begin + desc->stride_bytes[0] * 8));
  };
  EXPECT_EQ(read("a.png?depth_unit=0.001"), std::pair(MAQ_PIXEL_DEPTH16, pixels));
  const auto [format, metres] = read("a.tiff?depth_unit=1");
  ASSERT_EQ(format, MAQ_PIXEL_DEPTH32F);
  for (size_t i = 0; i < 64; ++i) {
    float found = 0;
    uint16_t stored = 0;
    std::memcpy(&found, &metres[4 * i], 4);
    std::memcpy(&stored, &pixels[2 * i], 2);
    EXPECT_FLOAT_EQ(found, float(stored) * 0.001f) << i;
  }
}

TEST_F(ApiSaving, DepthIsNoJpegAndLeavesNoFile) {
  const std::vector<uint8_t> pixels(8 * 8 * 4);
  for (const maq_pixel_format format : {MAQ_PIXEL_DEPTH16, MAQ_PIXEL_DEPTH32F}) {
    const maquette::Frame frame(context_, describe(format, pixels, 8, 8));
    for (const char* name : {"a.jpg", "a.webp", "a"}) {
      expect_refused(frame, folder_.file(name), MAQ_ERROR_INVALID_ARGUMENT, "ends neither in .png nor in .tiff");
    }
    expect_refused(frame, folder_.file("none/a.png"), MAQ_ERROR_UNWRITABLE, "none/a.png cannot be made");
  }
  EXPECT_EQ(files_in(folder_.path()), 0u);
}

TEST_F(ApiSaving, APlaceThatCannotBeWrittenIsNamed) {
  const std::vector<uint8_t> pixels = speckled(4, 4);
  const maquette::Frame frame(context_, describe(MAQ_PIXEL_RGB8, pixels, 4, 4));
  std::filesystem::create_directory(folder_.file("folder.png"));
  expect_refused(frame, folder_.file("none/a.png"), MAQ_ERROR_UNWRITABLE, "none/a.png cannot be made");
  expect_refused(frame, "/proc/a.png", MAQ_ERROR_UNWRITABLE, "/proc/a.png cannot be made");
  expect_refused(frame, folder_.file("folder.png"), MAQ_ERROR_UNWRITABLE, "is not a file");
  const maquette::DensePoseResult result = result_of(pixels, 4, 4);
  std::string text;
  EXPECT_EQ(status_of([&] { result.save(folder_.file("none/a")); }, &text), MAQ_ERROR_UNWRITABLE);
  EXPECT_NE(text.find("none/a_IUV.png cannot be made"), std::string::npos) << text;
  std::filesystem::create_directory(folder_.file("a.json"));
  EXPECT_EQ(status_of([&] { result.save(folder_.file("a")); }), MAQ_ERROR_UNWRITABLE);
  EXPECT_EQ(files_in(folder_.path()), 2u) << "none of three files where one has no place";
}

TEST_F(ApiSaving, AFullDiskLeavesTheOldFiles) {
  const std::vector<uint8_t> pixels = speckled(200, 100), black(200 * 100 * 3);
  const maquette::Frame large(context_, describe(MAQ_PIXEL_RGB8, pixels, 200, 100));
  for (const char* name : {"a.png", "a.jpg"}) {
    maquette::Frame(context_, describe(MAQ_PIXEL_RGB8, black, 200, 100)).save(folder_.file(name));
    const std::string before = read_text(folder_.file(name));
    for (const rlim_t most : {0, 1000}) {
      const FileSizeLimit full(most);
      expect_refused(large, folder_.file(name), MAQ_ERROR_UNWRITABLE, "cannot be written");
    }
    EXPECT_EQ(read_text(folder_.file(name)), before);
  }
  const maquette::DensePoseResult nobody = result_of(black, 200, 100), somebody = result_of(one_person(), 320, 256);
  nobody.save(folder_.file("a"));
  const std::string json = read_text(folder_.file("a.json")), inds = read_text(folder_.file("a_INDS.png"));
  {
    const FileSizeLimit full(300);  // the JSON has room, images do not
    EXPECT_EQ(status_of([&] { somebody.save(folder_.file("a")); }), MAQ_ERROR_UNWRITABLE);
  }
  EXPECT_EQ(read_text(folder_.file("a.json")), json);
  EXPECT_EQ(read_text(folder_.file("a_INDS.png")), inds);
  EXPECT_EQ(files_in(folder_.path()), 5u) << "nothing is left over";
  somebody.save(folder_.file("a"));
  EXPECT_NE(read_text(folder_.file("a.json")), json);
}

TEST_F(ApiSaving, AResultIsThreeFilesInTheDensePoseConvention) {
  const maquette::DensePoseResult result = result_of(one_person(), 320, 256);
  result.save(folder_.file("a 50"));
  EXPECT_EQ(files_in(folder_.path()), 3u);
  EXPECT_EQ(read_text(folder_.file("a 50.json")),
            "{\"width\":320,\"height\":256,\"people\":[{\"box\":[67.2,84.0,99.2,116.0],\"score\":0.9526,\"id\":1}]}\n");
  const std::vector<uint8_t> iuv = read_rgb(context_, folder_.file("a 50_IUV.png"));
  const std::vector<uint8_t> inds = read_rgb(context_, folder_.file("a 50_INDS.png"));
  EXPECT_EQ(colour_type(folder_.file("a 50_INDS.png")), 0);
  size_t stride = 0;
  const uint8_t* planes[] = {result.plane(MAQ_DENSEPOSE_PLANE_V, &stride), result.plane(MAQ_DENSEPOSE_PLANE_U, &stride),
                             result.plane(MAQ_DENSEPOSE_PLANE_PART, &stride),
                             result.plane(MAQ_DENSEPOSE_PLANE_PERSON, &stride)};
  int64_t painted = 0;
  for (size_t y = 0; y < 256; ++y) {
    for (size_t x = 0; x < 320; ++x) {
      const size_t file_pixel = (y * 320 + x) * 3, pixel = y * stride + x;
      for (size_t channel = 0; channel < 3; ++channel) ASSERT_EQ(iuv[file_pixel + channel], planes[channel][pixel]);
      ASSERT_EQ(inds[file_pixel], planes[3][pixel]);
      painted += planes[2][pixel] > 0;
    }
  }
  EXPECT_GT(painted, 500);
}

TEST_F(ApiSaving, BoxesAreShortNumbers) {
  result_of(one_person(160), 320, 256).save(folder_.file("a"));
  EXPECT_NE(read_text(folder_.file("a.json")).find("[147.2,84.0,179.2,116.0]"), std::string::npos)
      << read_text(folder_.file("a.json"));
}

TEST_F(ApiSaving, AResultWithoutPeopleSaysSo) {
  const std::vector<uint8_t> black(40 * 30 * 3);
  result_of(black, 40, 30).save(folder_.file("a"));
  EXPECT_EQ(read_text(folder_.file("a.json")), "{\"width\":40,\"height\":30,\"people\":[]}\n");
  EXPECT_EQ(read_rgb(context_, folder_.file("a_IUV.png")), black);
}

TEST_F(ApiSaving, APathEndsWithTheBeginningOfAName) {
  const std::vector<uint8_t> pixels = speckled(4, 4);
  const maquette::DensePoseResult result = result_of(pixels, 4, 4);
  for (const std::string& path : {std::string(), folder_.file("")}) {
    EXPECT_EQ(status_of([&] { result.save(path); }), MAQ_ERROR_INVALID_ARGUMENT) << path;
    EXPECT_NE(std::string(maq_last_error(result.get())).find("path is"), std::string::npos);
  }
  EXPECT_EQ(files_in(folder_.path()), 0u);
}

TEST_F(ApiSaving, ThreadsThatSaveToOneNameLeaveOneWholeFile) {
  std::vector<std::vector<uint8_t>> pictures;
  for (uint32_t seed = 1; seed <= 3; ++seed) pictures.push_back(speckled(100, 80, seed));
  std::vector<std::thread> threads;
  for (const std::vector<uint8_t>& picture : pictures) {
    threads.emplace_back([&] {
      const maquette::Frame frame(context_, describe(MAQ_PIXEL_RGB8, picture, 100, 80));
      for (int i = 0; i < 10; ++i) EXPECT_EQ(maq_frame_save(frame.get(), folder_.file("a.png").c_str()), MAQ_OK);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(files_in(folder_.path()), 1u);
  EXPECT_NE(std::find(pictures.begin(), pictures.end(), read_rgb(context_, folder_.file("a.png"))), pictures.end());
}

}  // namespace
