// Captures cut at every byte, with every byte changed, and with counts that no file holds: a status or a smaller
// capture.
#include <gtest/gtest.h>

#include <cmath>

#include "scene/capture/capture.h"
#include "support/capture_files.h"
#include "support/expect_error.h"
#include "support/peak_memory.h"

namespace {

class SceneImportDamage : public ::testing::Test {
 protected:
  SceneImportDamage() { made_.write_photos(folder_); }

  // Whether the capture can be opened; what is in it must be sound.
  bool opens(const std::string& what) {
    try {
      const maq::Capture capture = maq::open_capture(folder_.path().string());
      EXPECT_GE(capture.views.size(), 1u) << what;
      EXPECT_LE(capture.views.size(), made_.images.size()) << what;
      EXPECT_GE(capture.cloud.count(), 1u) << what;
      EXPECT_LE(capture.cloud.count(), made_.points.size()) << what;
      EXPECT_EQ(capture.cloud.rgb.size(), 3 * capture.cloud.count()) << what;
      for (const maq::CaptureView& view : capture.views) maq::check_camera(view.camera, "A view");
      for (size_t i = 0; i < capture.cloud.count(); ++i) {
        EXPECT_TRUE(std::isfinite(capture.cloud.x[i] + capture.cloud.y[i] + capture.cloud.z[i])) << what;
      }
      maq::Frame picture;
      std::vector<uint8_t> valid;
      maq::load_view(capture.views[0], picture, valid);
      return true;
    } catch (const maq::Error& error) {
      EXPECT_TRUE(error.status() == MAQ_ERROR_UNREADABLE || error.status() == MAQ_ERROR_UNSUPPORTED ||
                  error.status() == MAQ_ERROR_NOT_FOUND)
          << what << ": " << error.what();
      EXPECT_EQ(std::string(error.what()).back(), '.') << what << ": " << error.what();
      return false;
    }
  }

  void damage(const std::string& name) {
    const std::string path = folder_.file(name), whole = read_text(path);
    ASSERT_TRUE(opens(name));
    int opened = 0, refused = 0;
    for (size_t length = 0; length < whole.size(); ++length) {
      write_text(path, whole.substr(0, length));
      opens(name + " cut at " + std::to_string(length)) ? ++opened : ++refused;
      if (HasFailure()) return;
    }
    EXPECT_GT(refused, 0);
    if (name.substr(name.size() - 3) == "bin") {
      EXPECT_EQ(opened, 0) << name << ": binary files know their end";
    }
    for (size_t i = 0; i < whole.size(); ++i) {
      for (const int mask : {0x01, 0x10, 0x40, 0x80, 0xff}) {
        std::string changed = whole;
        changed[i] = char(changed[i] ^ mask);
        write_text(path, changed);
        opens(name + " changed at " + std::to_string(i) + " by " + std::to_string(mask));
        if (HasFailure()) return;
      }
    }
    write_text(path, whole);
  }

  MadeCapture made_;
  const TempFolder folder_;
};

TEST_F(SceneImportDamage, BinaryModels) {
  made_.cameras[0] = {7, "OPENCV", 4, 32, 24, {30, 31, 16.25, 11.5, -0.1, 0.02, 0.001, 0.002}};
  made_.write_colmap(folder_, false);
  for (const char* name : {"cameras", "images", "points3D"}) damage(std::string("sparse/0/") + name + ".bin");
}

TEST_F(SceneImportDamage, TextModels) {
  made_.cameras[0] = {7, "OPENCV_FISHEYE", 5, 32, 24, {30, 31, 16.25, 11.5, -0.1, 0.02, 0.001, 0.002}};
  made_.write_colmap(folder_, true);
  for (const char* name : {"cameras", "images", "points3D"}) damage(std::string("sparse/0/") + name + ".txt");
}

TEST_F(SceneImportDamage, Transforms) {
  write_text(folder_.file("points.ply"), made_.ply_text());
  write_text(folder_.file("transforms.json"),
             R"({"fl_x": 30.5, "fl_y": 31, "cx": 16, "cy": 12, "w": 32, "h": 24, "k1": -0.1, "p1": 0.001,
"camera_model": "OPENCV", "ply_file_path": "points.ply", "frames": [
{"file_path": "images/a.png", "transform_matrix": [[1, 0, 0, 0.5], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]},
{"file_path": "./images/b.png", "transform_matrix": [[0, 0, 1, 0.5], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]}]})");
  damage("transforms.json");
}

TEST_F(SceneImportDamage, Photos) {
  made_.images[0].name = "a.bmp";
  made_.write_photos(folder_, "images", 8, 6);
  made_.write_colmap(folder_, false);
  damage("images/a.bmp");
}

TEST_F(SceneImportDamage, CountsThatNoFileHoldsTakeNoMemory) {
  made_.write_colmap(folder_, false);
  for (const char* name : {"cameras", "images", "points3D"}) {
    const std::string path = folder_.file(std::string("sparse/0/") + name + ".bin"), whole = read_text(path);
    for (const uint64_t count : {uint64_t(20'000'000), uint64_t(1) << 40, uint64_t(UINT64_MAX)}) {
      std::string changed;
      append(changed, count);
      write_text(path, changed + whole.substr(8));
      const double growth_mib = peak_memory_growth_mib([&] {
        expect_error(MAQ_ERROR_UNREADABLE, "claims " + std::to_string(count),
                     [&] { maq::open_capture(folder_.path().string()); });
      });
      EXPECT_LT(growth_mib, 8) << name;
    }
    write_text(path, whole);
  }
  // The points that an image saw, and the images that saw a point.
  std::string images = made_.images_binary(), points = made_.points_binary();
  const size_t seen = 8 + 4 + 56 + 4 + 6, track = 8 + 8 + 24 + 3 + 8;
  ASSERT_EQ(images[seen], 2);
  ASSERT_EQ(points[track], 1);
  images.replace(seen, 8, 8, '\xff');
  points.replace(track, 8, 8, '\x7f');
  write_text(folder_.file("sparse/0/images.bin"), images);
  expect_error(MAQ_ERROR_UNREADABLE, "points seen in an image", [&] { maq::open_capture(folder_.path().string()); });
  write_text(folder_.file("sparse/0/images.bin"), made_.images_binary());
  write_text(folder_.file("sparse/0/points3D.bin"), points);
  expect_error(MAQ_ERROR_UNREADABLE, "images of a point", [&] { maq::open_capture(folder_.path().string()); });
}

// As when a count was changed to a smaller one.
TEST_F(SceneImportDamage, BytesBehindTheLastRecordAreRefused) {
  made_.write_colmap(folder_, false);
  for (const char* name : {"cameras", "images", "points3D"}) {
    const std::string path = folder_.file(std::string("sparse/0/") + name + ".bin"), whole = read_text(path);
    write_text(path, whole + "x");
    expect_error(MAQ_ERROR_UNREADABLE, "1 bytes after the last", [&] { maq::open_capture(folder_.path().string()); });
    write_text(path, whole);
  }
}

TEST_F(SceneImportDamage, LinesWithoutEndTakeNoMemory) {
  made_.write_colmap(folder_, true);
  const std::string path = folder_.file("sparse/0/images.txt");
  write_text(path, "1 1 0 0 0 0 0 0 7 a");
  std::filesystem::resize_file(path, 100 << 20);
  const double growth_mib = peak_memory_growth_mib([&] {
    expect_error(MAQ_ERROR_UNREADABLE, "no photo that can be used",
                 [&] { maq::open_capture(folder_.path().string()); });
  });
  EXPECT_LT(growth_mib, 8);
}

}  // namespace
