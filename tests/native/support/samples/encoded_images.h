// Encoded images for tests of decoders, and their EXIF orientation.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "image/files/image_header.h"

namespace encoded_images {

using Bytes = std::vector<uint8_t>;

// Where nothing but the last bits of a colour differ, an encoder has something to do.
inline cv::Mat smooth(int width, int height) {
  cv::Mat image(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at<cv::Vec3b>(y, x) = cv::Vec3b(uint8_t(x * 3), uint8_t(y * 3), uint8_t((x + y) * 2));
    }
  }
  return image;
}

inline Bytes encoded(const char* extension, const cv::Mat& image, const std::vector<int>& options = {}) {
  Bytes bytes;
  EXPECT_TRUE(cv::imencode(extension, image, bytes, options));
  return bytes;
}

inline Bytes text(const std::string& bytes) { return {bytes.begin(), bytes.end()}; }

inline void append(Bytes& bytes, const Bytes& more) { bytes.insert(bytes.end(), more.begin(), more.end()); }

// A TIFF directory whose one entry is the orientation.
inline Bytes exif(int orientation, bool is_little) {
  if (is_little)
    return text(std::string("II*\0\x08\0\0\0\1\0\x12\1\3\0\1\0\0\0", 18) + char(orientation) + std::string(7, 0));
  return text(std::string("MM\0*\0\0\0\x08\0\1\1\x12\0\3\0\0\0\1\0", 19) + char(orientation) + std::string(6, 0));
}

inline Bytes with_exif(const std::string& extension, const Bytes& image, const Bytes& exif) {
  Bytes bytes = image;
  if (extension == ".jpg") {
    Bytes segment = {0xff, 0xe1, 0, uint8_t(exif.size() + 8), 'E', 'x', 'i', 'f', 0, 0};
    append(segment, exif);
    bytes.insert(bytes.begin() + 2, segment.begin(), segment.end());
  } else {  // WebP: in the extended container, whose size is that of the image
    const auto size = *maq::read_image_size(image);
    Bytes chunks = text("WEBPVP8X");
    append(chunks, {10, 0, 0, 0, 8, 0, 0, 0, uint8_t(size.width - 1), 0, 0, uint8_t(size.height - 1), 0, 0});
    append(chunks, Bytes(image.begin() + 12, image.end()));
    append(chunks, text("EXIF"));
    append(chunks, {uint8_t(exif.size()), 0, 0, 0});
    append(chunks, exif);
    bytes = text("RIFF");
    append(bytes, {uint8_t(chunks.size()), uint8_t(chunks.size() >> 8), uint8_t(chunks.size() >> 16), 0});
    append(bytes, chunks);
  }
  return bytes;
}

}  // namespace encoded_images
