// Files of depth: what is read and written, and what is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "core/files/file.h"
#include "image/files/depth_file.h"
#include "image/files/image_file.h"
#include "support/expect_error.h"
#include "support/temp_folder.h"

namespace {

class DepthFiles : public ::testing::Test {
 protected:
  std::string written(const std::string& name, const cv::Mat& image) {
    EXPECT_TRUE(cv::imwrite(folder_.file(name), image));
    return folder_.file(name);
  }
  static maq::Frame read(const std::string& path, double unit_m) {
    maq::Frame frame;
    maq::read_depth_file(path, unit_m, frame);
    return frame;
  }
  static std::vector<float> floats(const maq::Frame& frame) {
    EXPECT_EQ(frame.image.format, MAQ_PIXEL_DEPTH32F);
    std::vector<float> values(frame.storage.size() / sizeof(float));
    std::memcpy(values.data(), frame.storage.data(), frame.storage.size());
    return values;
  }
  static std::vector<uint16_t> steps(const maq::Frame& frame) {
    EXPECT_EQ(frame.image.format, MAQ_PIXEL_DEPTH16);
    std::vector<uint16_t> values(frame.storage.size() / sizeof(uint16_t));
    std::memcpy(values.data(), frame.storage.data(), frame.storage.size());
    return values;
  }
  // 17 x 31, each pixel another.
  static cv::Mat ramp() {
    cv::Mat image(31, 17, CV_16UC1);
    for (int i = 0; i < 31 * 17; ++i) image.at<uint16_t>(i / 17, i % 17) = uint16_t(i * 124);
    return image;
  }

  const TempFolder folder_;
};

TEST_F(DepthFiles, SixteenBitsOfMillimetresStayAsTheyAre) {
  const cv::Mat image = ramp();
  for (const char* name : {"a.png", "a.tiff"}) {
    const maq::Frame frame = read(written(name, image), 0.001);
    EXPECT_EQ(frame.image.width_px, 17) << name;
    EXPECT_EQ(frame.image.height_px, 31) << name;
    EXPECT_EQ(steps(frame), std::vector<uint16_t>(image.begin<uint16_t>(), image.end<uint16_t>())) << name;
  }
}

TEST_F(DepthFiles, OtherUnitsAndFloatsBecomeMetres) {
  const cv::Mat image = ramp();
  const std::vector<float> metres = floats(read(written("a.png", image), 0.00025));
  for (int i = 0; i < 31 * 17; ++i) ASSERT_FLOAT_EQ(metres[size_t(i)], float(i * 124 * 0.00025)) << i;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinite = std::numeric_limits<float>::infinity();
  const cv::Mat stored = (cv::Mat_<float>(2, 3) << 1.25f, kNan, -3, 0, kInfinite, 80.5f);
  EXPECT_EQ(floats(read(written("b.tiff", stored), 1)), (std::vector<float>{1.25f, 0, 0, 0, 0, 80.5f}));
  EXPECT_EQ(floats(read(written("b.tif", stored), 2)), (std::vector<float>{2.5f, 0, 0, 0, 0, 161}));
}

TEST_F(DepthFiles, PicturesAreNoDepth) {
  const cv::Mat bgr(8, 8, CV_8UC3, cv::Scalar(1, 2, 3)), deep(8, 8, CV_16UC3, cv::Scalar(1, 2, 3));
  const cv::Mat grey(8, 8, CV_8UC1, cv::Scalar(9)), floats(8, 8, CV_32FC3, cv::Scalar(1, 2, 3));
  const cv::Mat doubles(8, 8, CV_64FC1, cv::Scalar(1));
  const std::pair<const char*, cv::Mat> all[] = {
      {"a.png", bgr},  {"b.png", deep},  {"c.png", grey},  {"a.jpg", bgr},     {"a.webp", bgr},    {"a.bmp", grey},
      {"a.tiff", bgr}, {"b.tiff", deep}, {"c.tiff", grey}, {"d.tiff", floats}, {"e.tiff", doubles}};
  for (const auto& [name, image] : all) {
    expect_error(MAQ_ERROR_UNSUPPORTED, std::string(name) + " is no depth image",
                 [&, path = written(name, image)] { read(path, 0.001); });
  }
}

TEST_F(DepthFiles, CutFilesAreDamagedAndNothingElse) {
  for (const char* name : {"a.png", "a.tiff"}) {
    const std::vector<uint8_t> whole = maq::read_file(written(name, ramp()), 1 << 20);
    for (size_t length = 0; length < whole.size(); length += 1 + length / 9) {
      std::ofstream(folder_.file("cut"), std::ios::binary)
          .write(reinterpret_cast<const char*>(whole.data()), std::streamsize(length));
      expect_error(MAQ_ERROR_UNREADABLE, "cut", [&] { read(folder_.file("cut"), 0.001); });
    }
  }
}

// The numbers of a header that asks for more than there may be, before any pixel is read.
TEST_F(DepthFiles, GiantSizesAreRefusedByTheHeader) {
  std::vector<uint8_t> png = maq::read_file(written("a.png", ramp()), 1 << 20);
  png[16] = 0x40;  // a width of 2^30 and more
  std::vector<uint8_t> tiff = maq::read_file(written("a.tiff", ramp()), 1 << 20);
  const uint8_t width_tag[4] = {0x00, 0x01, 3, 0};  // 256, a SHORT
  const auto entry = std::search(tiff.begin(), tiff.end(), width_tag, width_tag + 4);
  ASSERT_NE(entry, tiff.end());
  entry[8] = entry[9] = 0xff;
  for (const auto& [name, bytes] : {std::pair{"a.png", &png}, {"a.tiff", &tiff}}) {
    std::ofstream(folder_.file(name), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes->data()), std::streamsize(bytes->size()));
    expect_error(MAQ_ERROR_IMAGE_SIZE, "over the limit", [&, path = folder_.file(name)] { read(path, 0.001); });
  }
}

TEST_F(DepthFiles, AreWrittenInMillimetresOrInMetresAndReadBackEqual) {
  maq::Frame floats_frame, steps_frame;
  auto* metres = reinterpret_cast<float*>(floats_frame.allocate(MAQ_PIXEL_DEPTH32F, 4, 2));
  const float values[8] = {0.5f, 1.2345678f, 0, 65.5344f, 65.5345f, 1e9f, 0.0004f, 0.0006f};
  std::copy(values, values + 8, metres);
  auto* stored = reinterpret_cast<uint16_t*>(steps_frame.allocate(MAQ_PIXEL_DEPTH16, 4, 2));
  const uint16_t counts[8] = {0, 1, 2, 1000, 32768, 65533, 65534, 65535};
  std::copy(counts, counts + 8, stored);

  maq::write_depth_file(floats_frame.image, folder_.file("f.tiff"));
  EXPECT_EQ(floats(read(folder_.file("f.tiff"), 1)), std::vector<float>(values, values + 8));
  maq::write_depth_file(floats_frame.image, folder_.file("f.png"));
  EXPECT_EQ(steps(read(folder_.file("f.png"), 0.001)), (std::vector<uint16_t>{500, 1235, 0, 65534, 0, 0, 0, 1}));
  maq::write_depth_file(steps_frame.image, folder_.file("s.PNG"));
  EXPECT_EQ(steps(read(folder_.file("s.PNG"), 0.001)), std::vector<uint16_t>(counts, counts + 8));
  maq::write_depth_file(steps_frame.image, folder_.file("s.tif"));
  const std::vector<float> back = floats(read(folder_.file("s.tif"), 1));
  for (size_t i = 0; i < 7; ++i) EXPECT_FLOAT_EQ(back[i], float(counts[i]) * 0.001f);
  EXPECT_EQ(back[7], 0) << "the end of the range";
}

// An image in the app's memory: padded rows at an odd address.
TEST_F(DepthFiles, AreWrittenOfPaddedRows) {
  std::vector<uint8_t> memory(1 + 31 * 37, 0xEE);
  const cv::Mat image = ramp();
  for (int y = 0; y < 31; ++y) std::memcpy(&memory[1 + size_t(y) * 37], image.ptr(y), 34);
  const maq::ImageView view{MAQ_PIXEL_DEPTH16, 17, 31, {{&memory[1], 37}, {}}};
  maq::write_depth_file(view, folder_.file("a.png"));
  EXPECT_EQ(steps(read(folder_.file("a.png"), 0.001)),
            std::vector<uint16_t>(image.begin<uint16_t>(), image.end<uint16_t>()));
}

}  // namespace
