// PLY clouds of every form, and files that are not PLY.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "scene/capture/ply_reader.h"
#include "support/capture_files.h"
#include "support/expect_error.h"
#include "support/peak_memory.h"

namespace {

constexpr std::array<double, 3> kOrigin = {0.5, 0.25, -1};

class PlyFiles : public ::testing::Test {
 protected:
  maq::PointCloud read(const std::string& text, const std::array<double, 3>& origin = kOrigin) {
    write_text(folder_.file("cloud.ply"), text);
    report_ = {};
    return maq::read_ply_file(folder_.file("cloud.ply"), origin, report_);
  }
  void expect_refused(const std::string& text, const std::string& part, maq_status status = MAQ_ERROR_UNREADABLE) {
    expect_error(status, part, [&] { read(text); });
  }

  const TempFolder folder_;
  maq::ImportReport report_;
};

// One that has a vertex element of these properties, as text.
std::string ascii(const std::string& properties, const std::string& data, int count = 1) {
  return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) + "\n" + properties + "end_header\n" + data;
}
constexpr char kXyz[] = "property float x\nproperty float y\nproperty float z\n";

TEST_F(PlyFiles, EveryFormGivesTheSamePoints) {
  const MadeCapture made;
  for (const std::string& file : {made.ply_text(), made.ply_binary(false), made.ply_binary(true)}) {
    const maq::PointCloud cloud = read(file);
    ASSERT_EQ(cloud.count(), made.points.size());
    ASSERT_EQ(cloud.rgb.size(), 3 * made.points.size());
    for (size_t i = 0; i < cloud.count(); ++i) {
      const MadePoint& point = made.points[i];
      EXPECT_EQ(cloud.x[i], float(point.x - kOrigin[0]));
      EXPECT_EQ(cloud.y[i], float(point.y - kOrigin[1]));
      EXPECT_EQ(cloud.z[i], float(point.z - kOrigin[2]));
      EXPECT_EQ(cloud.rgb[3 * i], point.red);
      EXPECT_EQ(cloud.rgb[3 * i + 1], point.green);
      EXPECT_EQ(cloud.rgb[3 * i + 2], point.blue);
    }
    EXPECT_TRUE(report_.list().empty());
  }
}

TEST_F(PlyFiles, EveryTypeIsReadInBothByteOrders) {
  for (const bool is_big : {false, true}) {
    std::string file =
        std::string("ply\r\nformat binary_") + (is_big ? "big" : "little") +
        "_endian 1.0\r\nelement vertex 1\r\nproperty char a\r\nproperty uint16 b\r\nproperty int16 x\r\n" +
        "property int y\r\nproperty uint z\r\nproperty float64 c\r\nend_header\r\n";
    append(file, int8_t(-1));
    append(file, uint16_t(65535), is_big);
    append(file, int16_t(-300), is_big);
    append(file, int32_t(-70000), is_big);
    append(file, uint32_t(3000000000), is_big);
    append(file, 1.5, is_big);
    const maq::PointCloud cloud = read(file, {0, 0, 0});
    ASSERT_EQ(cloud.count(), 1u);
    EXPECT_EQ(cloud.x[0], -300);
    EXPECT_EQ(cloud.y[0], -70000);
    EXPECT_EQ(cloud.z[0], 3000000000.f);
    EXPECT_TRUE(cloud.rgb.empty());
  }
}

TEST_F(PlyFiles, PositionsFarFromTheWorldsOriginKeepTheirPrecision) {
  const maq::PointCloud cloud =
      read(ascii("property double x\nproperty double y\nproperty double z\n", "1000000.123456 -2000000.5 3e6"),
           {1e6, -2e6, 3e6});
  EXPECT_NEAR(cloud.x[0], 0.123456, 1e-7);
  EXPECT_EQ(cloud.y[0], -0.5f);
  EXPECT_EQ(cloud.positions().origin[0], 1e6);
}

TEST_F(PlyFiles, ColoursOfEveryKindBecomeBytes) {
  const auto colour = [&](const std::string& type, const std::string& values, const std::string& prefix = "") {
    std::string properties = kXyz;
    for (const char* name : {"red", "green", "blue"}) properties += "property " + type + " " + prefix + name + "\n";
    return read(ascii(properties, "0 0 0 " + values)).rgb;
  };
  using Rgb = std::vector<uint8_t>;
  EXPECT_EQ(colour("uchar", "1 2 255"), (Rgb{1, 2, 255}));
  EXPECT_EQ(colour("uchar", "1 2 255", "diffuse_"), (Rgb{1, 2, 255}));
  EXPECT_EQ(colour("float", "0 0.5 1"), (Rgb{0, 128, 255}));
  EXPECT_EQ(colour("double", "0 128 254.6"), (Rgb{0, 128, 255}));
  EXPECT_EQ(colour("ushort", "0 32896 65535"), (Rgb{0, 128, 255}));
  EXPECT_EQ(colour("int", "-5 300 77"), (Rgb{0, 255, 77}));
  EXPECT_EQ(colour("uchar", "1 2 3", "ambient_"), Rgb());
}

TEST_F(PlyFiles, PointsThatAreNotFiniteAreDroppedAndCounted) {
  const std::string colours = "property float red\nproperty float green\nproperty float blue\n";
  const maq::PointCloud cloud = read(ascii(kXyz + colours,
                                           "nan 0 0 0 0 0\n0 inf 0 0 0 0\n0 0 -inf 0 0 0\n1e300 0 0 0 0 0\n"
                                           "1 2 3 0 0 nan\n4 5 6 0 0 1\n",
                                           6));
  ASSERT_EQ(cloud.count(), 1u);
  EXPECT_EQ(cloud.x[0], 3.5f);
  EXPECT_EQ(cloud.rgb, (std::vector<uint8_t>{0, 0, 255}));
  ASSERT_EQ(report_.list().size(), 2u);
  EXPECT_EQ(maq::describe(report_.list()[0]), "4 points whose position is not finite");
  EXPECT_EQ(maq::describe(report_.list()[1]), "1 points whose colour is not finite");
}

TEST_F(PlyFiles, AFileWithoutPointsIsAnEmptyCloud) { EXPECT_EQ(read(ascii(kXyz, "", 0)).count(), 0u); }

TEST_F(PlyFiles, WhatIsNoCloudIsRefusedWithASentence) {
  expect_error(MAQ_ERROR_NOT_FOUND, "does not exist",
               [&] { maq::read_ply_file(folder_.file("no.ply"), kOrigin, report_); });
  expect_error(MAQ_ERROR_UNREADABLE, "is not a file",
               [&] { maq::read_ply_file(folder_.path().string(), kOrigin, report_); });
  expect_refused("", "its first line is not \"ply\"");
  expect_refused("solid\n", "its first line is not \"ply\"");
  expect_refused("ply\nformat ascii 1.0\n", "no end of its head");
  expect_refused("ply\nelement vertex 0\nend_header\n", "does not say its format");
  expect_refused("ply\nformat morse 1.0\nend_header\n", "\"morse\" is not a format");
  expect_refused("ply\nformat ascii\nend_header\n", "needs a name and a version");
  expect_refused("ply\nformat ascii 2.0\nend_header\n", "of version 2.0", MAQ_ERROR_UNSUPPORTED);
  expect_refused("ply\nformat ascii 1.0\nend_header\n", "no vertices");
  expect_refused("ply\nformat ascii 1.0\nproperty float x\nend_header\n", "before the first element");
  expect_refused("ply\nformat ascii 1.0\nelement vertex -3\nend_header\n", "how many there are");
  expect_refused("ply\nformat ascii 1.0\nelement vertex 1e3000\nend_header\n", "how many there are");
  expect_refused("ply\nformat ascii 1.0\nelement vertex 1.5\nend_header\n", "how many there are");
  expect_refused("ply\nformat ascii 1.0\nvertex 3\nend_header\n", "line 3: \"vertex\" is nothing");
  expect_refused(ascii("property half x\n", ""), "line 4: \"half\" is not a type");
  expect_refused(ascii("property list float int x\n", ""), "must be of a whole one");
  expect_refused(ascii("property float x\nproperty float y\n", "1 2"), "without \"z\"");
  expect_refused(ascii(kXyz, "1 2"), "has bytes for 0 at most");
  expect_refused(ascii(kXyz, "1 2     "), "ends early");
  expect_refused(ascii(kXyz, "1 2 x"), "line 8: \"x\" is not a number");
  expect_refused(ascii(kXyz, "1 2 " + std::string(100, '3')), "over 64 letters");
  std::string wide = "ply\nformat ascii 1.0\n";
  for (int i = 0; i < 100; ++i) wide += "element e" + std::to_string(i) + " 0\n";
  expect_refused(wide + "end_header\n", "over 64 kinds");
}

TEST_F(PlyFiles, ListsLongerThanTheFileAreRefused) {
  for (const char* length : {"-1", "0.5", "1000000000", "nan", "1e300"}) {
    expect_refused(ascii(std::string("property list int int l\n") + kXyz, std::string(length) + " 0 0 0 0"),
                   "list \"l\"");
  }
  std::string file =
      "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint double v\n"
      "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  append(file, uint32_t(0xffffffff));
  expect_refused(file + std::string(40, 'a'), "list \"v\" of length");
}

// Elements without any property take no bytes, so no file is too short for them.
TEST_F(PlyFiles, ElementsWithoutPropertiesTakeNoTime) {
  const std::string vertex = std::string("element vertex 1\n") + kXyz + "end_header\n1 2 3";
  EXPECT_EQ(read("ply\nformat ascii 1.0\nelement nothing 9000000000000000\n" + vertex).count(), 1u);
}

TEST_F(PlyFiles, ClaimsOf20MillionPointsAndMoreTakeNoMemory) {
  const double growth_mib = peak_memory_growth_mib([&] {
    for (const char* form : {"ascii", "binary_little_endian", "binary_big_endian"}) {
      for (const char* count : {"20000000", "4000000000", "9000000000000000"}) {
        expect_refused(std::string("ply\nformat ") + form + " 1.0\nelement vertex " + count + "\n" + kXyz +
                           "end_header\n" + std::string(1000, '1'),
                       "claims " + std::string(count));
      }
    }
  });
  EXPECT_LT(growth_mib, 8);
}

TEST_F(PlyFiles, MoreThan30MillionPointsAreUnsupported) {
  const std::string path = folder_.file("sparse.ply");
  write_text(path,
             "ply\nformat binary_little_endian 1.0\nelement vertex 30000001\nproperty char x\nproperty char y\n"
             "property char z\nend_header\n");
  std::filesystem::resize_file(path, 95'000'000);  // a hole: it takes no disk
  const double growth_mib = peak_memory_growth_mib([&] {
    expect_error(MAQ_ERROR_UNSUPPORTED, "30000001 points, over the limit of 30000000",
                 [&] { maq::read_ply_file(path, kOrigin, report_); });
  });
  EXPECT_LT(growth_mib, 8);
}

TEST_F(PlyFiles, TwoMillionPointsTakeTheirPositionsAndColoursAndLittleMore) {
  constexpr size_t kCount = 2'000'000;
  const std::string path = folder_.file("large.ply");
  {
    std::string file = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(kCount) + "\n" + kXyz +
                       "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    for (size_t i = 0; i < kCount; ++i) {
      for (const float value : {float(i), 1.f, 2.f}) append(file, value);
      file.append(3, char(i));
    }
    write_text(path, file);
  }
  const double growth_mib = peak_memory_growth_mib([&] {
    const maq::PointCloud cloud = maq::read_ply_file(path, kOrigin, report_);
    ASSERT_EQ(cloud.count(), kCount);
    EXPECT_EQ(cloud.x[kCount - 1], float(kCount - 1) - 0.5f);
    EXPECT_EQ(cloud.rgb[3 * kCount - 1], uint8_t(kCount - 1));
  });
  RecordProperty("growth_mib", std::to_string(growth_mib));
  EXPECT_LT(growth_mib, 15.0 * kCount / (1 << 20) + 8);
}

TEST_F(PlyFiles, FilesCutAtEveryByteAreRefusedOrTheWhole) {
  const MadeCapture made;
  for (const std::string& file : {made.ply_text(), made.ply_binary(false), made.ply_binary(true)}) {
    size_t whole = 0;
    for (size_t length = 0; length < file.size(); ++length) {
      try {
        EXPECT_EQ(read(file.substr(0, length)).count(), made.points.size()) << length;
        ++whole;
      } catch (const maq::Error& error) {
        const bool is_cut_version = std::string(error.what()).find("of version 1") != std::string::npos;
        EXPECT_EQ(error.status(), is_cut_version ? MAQ_ERROR_UNSUPPORTED : MAQ_ERROR_UNREADABLE)
            << length << ": " << error.what();
      }
    }
    EXPECT_GT(whole, 0u) << "the face behind the vertices, or the last line's end, may be missing";
    EXPECT_LT(whole, 20u);
  }
}

TEST_F(PlyFiles, FilesWithAnyByteChangedAreAStatusOrFinite) {
  const MadeCapture made;
  for (const std::string& file : {made.ply_text(), made.ply_binary(false), made.ply_binary(true)}) {
    for (size_t i = 0; i < file.size(); ++i) {
      for (const int mask : {0x01, 0x10, 0x40, 0x80, 0xff}) {
        std::string changed = file;
        changed[i] = char(changed[i] ^ mask);
        try {
          const maq::PointCloud cloud = read(changed);
          ASSERT_LE(cloud.count(), made.points.size() * 10) << i;
          ASSERT_TRUE(cloud.rgb.empty() || cloud.rgb.size() == 3 * cloud.count()) << i;
          for (size_t k = 0; k < cloud.count(); ++k) {
            ASSERT_TRUE(std::isfinite(cloud.x[k]) && std::isfinite(cloud.y[k]) && std::isfinite(cloud.z[k])) << i;
          }
        } catch (const maq::Error& error) {
          ASSERT_TRUE(error.status() == MAQ_ERROR_UNREADABLE || error.status() == MAQ_ERROR_UNSUPPORTED)
              << error.what();
        }
      }
    }
  }
}

}  // namespace
