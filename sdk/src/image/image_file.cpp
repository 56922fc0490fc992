#include "image/image_file.h"

#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/file.h"
#include "image/image_header.h"

namespace maq {
namespace {

// OpenCV throws for some damaged files and returns an empty image for others.
cv::Mat decode(const cv::Mat& encoded, int flags) {
  try {
    return cv::imdecode(encoded, flags);
  } catch (const cv::Exception&) {
    return {};
  }
}

cv::Mat as_row(const uint8_t* bytes, size_t size_bytes) {
  return cv::Mat(1, int(size_bytes), CV_8UC1, const_cast<uint8_t*>(bytes));
}

}  // namespace

void read_image_file(const std::string& path, Frame& frame) {
  const std::vector<uint8_t> bytes = read_file(path);
  if (bytes.empty()) throw Error(MAQ_ERROR_UNREADABLE, path, " is empty; an image file was expected.");
  if (bytes.size() > size_t(1) << 30) {
    throw Error(MAQ_ERROR_UNREADABLE, path, " is over 1 GiB; an image file was expected.");
  }
  if (const auto size = read_image_size(bytes)) check_image_size(size->width, size->height, path);

  const cv::Mat image = decode(as_row(bytes.data(), bytes.size()), cv::IMREAD_COLOR);
  if (image.empty()) {
    throw Error(MAQ_ERROR_UNREADABLE, path,
                " cannot be decoded: it is damaged or no image; use a whole JPEG, PNG, WebP, BMP or TIFF file.");
  }
  check_image_size(image.cols, image.rows, path);
  uint8_t* pixels = frame.allocate_bgr(image.cols, image.rows);
  image.copyTo(cv::Mat(image.rows, image.cols, CV_8UC3, pixels));
}

BgraImage decode_bgra(const uint8_t* bytes, size_t size_bytes, const std::string& what) {
  cv::Mat image = decode(as_row(bytes, size_bytes), cv::IMREAD_UNCHANGED);
  if (image.empty() || image.depth() != CV_8U) throw Error(MAQ_ERROR_UNREADABLE, what, " cannot be decoded.");
  if (image.channels() == 3) cv::cvtColor(image, image, cv::COLOR_BGR2BGRA);
  if (image.channels() == 1) cv::cvtColor(image, image, cv::COLOR_GRAY2BGRA);
  BgraImage result{image.cols, image.rows, std::vector<uint8_t>(image.total() * 4)};
  image.copyTo(cv::Mat(image.rows, image.cols, CV_8UC4, result.pixels.data()));
  return result;
}

}  // namespace maq
