// Small captures for tests, written to disk in each of the forms that are read.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iomanip>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "support/temp_folder.h"

struct MadeCamera {
  uint32_t id;
  std::string model;
  int number;
  uint64_t width, height;
  std::vector<double> parameters;
};

struct MadeImage {
  uint32_t id;
  std::vector<double> pose;  // quaternion w, x, y, z, then translation
  uint32_t camera_id;
  std::string name;
};

struct MadePoint {
  double x, y, z;
  int red, green, blue;
};

template <class Number>
void append(std::string& bytes, Number number, bool is_big_endian = false) {
  char raw[sizeof number];
  std::memcpy(raw, &number, sizeof raw);
  if (is_big_endian) std::reverse(raw, raw + sizeof raw);
  bytes.append(raw, sizeof raw);
}

// A wall of points 4 units in front of cameras that stand side by side.
struct MadeCapture {
  std::vector<MadeCamera> cameras = {{7, "PINHOLE", 1, 32, 24, {30, 31, 16.25, 11.5}}};
  std::vector<MadeImage> images = {{1, {1, 0, 0, 0, 0, 0, 0}, 7, "a.png"},
                                   {2, {0.6, 0, 0.8, 0, 0.25, -0.5, 0.125}, 7, "b.png"},
                                   {5, {0.5, -0.5, 0.5, 0.5, 1.5, 1e-3, 2}, 7, "c.png"}};
  std::vector<MadePoint> points = {
      {-0.1, 0.3, 4, 255, 0, 10}, {1.0 / 3, 0.2, 4.5, 1, 2, 3}, {0.5, -0.25, 3.75, 9, 99, 199}, {0, 0, 4, 7, 7, 7}};

  std::string cameras_binary() const {
    std::string bytes;
    append(bytes, uint64_t(cameras.size()));
    for (const MadeCamera& camera : cameras) {
      append(bytes, camera.id);
      append(bytes, int32_t(camera.number));
      append(bytes, camera.width);
      append(bytes, camera.height);
      for (const double value : camera.parameters) append(bytes, value);
    }
    return bytes;
  }
  std::string images_binary() const {
    std::string bytes;
    append(bytes, uint64_t(images.size()));
    for (const MadeImage& image : images) {
      append(bytes, image.id);
      for (const double value : image.pose) append(bytes, value);
      append(bytes, image.camera_id);
      bytes += image.name;
      bytes.push_back('\0');
      append(bytes, uint64_t(2));
      for (int i = 0; i < 2; ++i) {
        append(bytes, 3.5 * i);
        append(bytes, 4.5);
        append(bytes, uint64_t(UINT64_MAX));
      }
    }
    return bytes;
  }
  std::string points_binary() const {
    std::string bytes;
    append(bytes, uint64_t(points.size()));
    uint64_t id = 0;
    for (const MadePoint& point : points) {
      append(bytes, ++id);
      for (const double value : {point.x, point.y, point.z}) append(bytes, value);
      for (const int value : {point.red, point.green, point.blue}) append(bytes, uint8_t(value));
      append(bytes, 0.75);
      append(bytes, uint64_t(1));
      append(bytes, uint32_t(1));
      append(bytes, uint32_t(0));
    }
    return bytes;
  }
  std::string cameras_text() const {
    std::ostringstream text = exact("# Camera list with one line of data per camera:\n");
    for (const MadeCamera& camera : cameras) {
      text << camera.id << " " << camera.model << " " << camera.width << " " << camera.height;
      for (const double value : camera.parameters) text << " " << value;
      text << "\n";
    }
    return text.str();
  }
  std::string images_text() const {
    std::ostringstream text = exact("# Image list with two lines of data per image:\n");
    for (const MadeImage& image : images) {
      text << image.id;
      for (const double value : image.pose) text << " " << value;
      text << " " << image.camera_id << " " << image.name << "\n";
      // COLMAP leaves the second line empty for images in which nothing was found.
      text << (image.id % 2 == 0 ? "" : "3.5 4.5 -1 7.25 1 12") << "\n";
    }
    return text.str();
  }
  std::string points_text() const {
    std::ostringstream text = exact("# 3D point list with one line of data per point:\n");
    int id = 0;
    for (const MadePoint& point : points) {
      text << ++id << " " << point.x << " " << point.y << " " << point.z << " " << point.red << " " << point.green
           << " " << point.blue << " 0.75 1 0\n";
    }
    return text.str();
  }
  std::string ply_text() const {
    std::ostringstream text = exact("ply\nformat ascii 1.0\ncomment made by a test\n");
    text << "element vertex " << points.size() << "\n"
         << "property double x\nproperty double y\nproperty double z\n"
         << "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    for (const MadePoint& point : points) {
      text << point.x << " " << point.y << " " << point.z << " " << point.red << " " << point.green << " " << point.blue
           << "\n";
    }
    return text.str();
  }
  // With properties in another order, some that nobody needs, and faces before and behind.
  std::string ply_binary(bool is_big_endian) const {
    std::ostringstream head = exact("ply\nformat ");
    head << (is_big_endian ? "binary_big_endian" : "binary_little_endian") << " 1.0\nobj_info none\n"
         << "element camera 2\nproperty float focal\nproperty list uchar int seen\n"
         << "element vertex " << points.size() << "\n"
         << "property uchar blue\nproperty list uint8 float32 weights\nproperty double z\nproperty uchar green\n"
         << "property float nx\nproperty double x\nproperty double y\nproperty uchar red\n"
         << "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    std::string bytes = head.str();
    for (int i = 0; i < 2; ++i) {
      append(bytes, 1.5f, is_big_endian);
      append(bytes, uint8_t(i));
      for (int k = 0; k < i; ++k) append(bytes, int32_t(4711), is_big_endian);
    }
    size_t weights = 0;
    for (const MadePoint& point : points) {
      append(bytes, uint8_t(point.blue));
      append(bytes, uint8_t(weights));
      for (size_t k = 0; k < weights; ++k) append(bytes, 0.5f, is_big_endian);
      weights = (weights + 1) % 3;
      append(bytes, point.z, is_big_endian);
      append(bytes, uint8_t(point.green));
      append(bytes, 0.1f, is_big_endian);
      append(bytes, point.x, is_big_endian);
      append(bytes, point.y, is_big_endian);
      append(bytes, uint8_t(point.red));
    }
    append(bytes, uint8_t(3));
    for (int32_t k = 0; k < 3; ++k) append(bytes, k, is_big_endian);
    return bytes;
  }

  void write_photos(const TempFolder& folder, const std::string& place = "images", int width = 32,
                    int height = 24) const {
    std::filesystem::create_directories(folder.path() / place);
    for (const MadeImage& image : images) {
      const std::string path = folder.file(place + "/" + image.name);
      std::filesystem::create_directories(std::filesystem::path(path).parent_path());
      cv::imwrite(path, cv::Mat(height, width, CV_8UC3, cv::Scalar(10, 20, 30)));
    }
  }
  void write_colmap(const TempFolder& folder, bool is_text, const std::string& place = "sparse/0") const {
    std::filesystem::create_directories(folder.path() / place);
    if (is_text) {
      write_text(folder.file(place + "/cameras.txt"), cameras_text());
      write_text(folder.file(place + "/images.txt"), images_text());
      write_text(folder.file(place + "/points3D.txt"), points_text());
    } else {
      write_text(folder.file(place + "/cameras.bin"), cameras_binary());
      write_text(folder.file(place + "/images.bin"), images_binary());
      write_text(folder.file(place + "/points3D.bin"), points_binary());
    }
  }

 private:
  static std::ostringstream exact(const char* text) {
    std::ostringstream stream;
    stream << text << std::setprecision(17);
    return stream;
  }
};
