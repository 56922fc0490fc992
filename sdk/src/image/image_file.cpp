#include "image/image_file.h"

#include <algorithm>
#include <filesystem>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/file.h"
#include "core/file_reader.h"
#include "image/file_decoders.h"

namespace maq {

void read_image_file(const std::string& path, Frame& frame, Orientation orientation) {
  std::error_code ignored;  // what is no file is for read_file() to say
  const uintmax_t size_bytes = std::filesystem::file_size(path, ignored);
  if (!ignored && size_bytes > uintmax_t(1) << 30) {
    throw Error(MAQ_ERROR_UNREADABLE, path, " is over 1 GiB; an image file was expected.");
  }
  const std::vector<uint8_t> bytes = read_file(path);
  if (bytes.empty()) throw Error(MAQ_ERROR_UNREADABLE, path, " is empty; an image file was expected.");
  if (const auto size = read_image_size(bytes)) check_image_size(size->width, size->height, path);

  const cv::Mat image = file_decoders().decode_image(bytes.data(), bytes.size(), orientation);
  if (image.empty()) {
    throw Error(MAQ_ERROR_UNREADABLE, path,
                " cannot be decoded: it is damaged or no image; use a whole JPEG, PNG, WebP, BMP or TIFF file.");
  }
  check_image_size(image.cols, image.rows, path);
  uint8_t* pixels = frame.allocate_bgr(image.cols, image.rows);
  image.copyTo(cv::Mat(image.rows, image.cols, CV_8UC3, pixels));
}

SizePx read_image_file_size(const std::string& path) {
  {
    FileReader file(path);
    // Up to a JPEG's size there may be a preview and colour tables.
    std::vector<uint8_t> start(size_t(std::min<uint64_t>(file.remaining(), 1 << 18)));
    file.read(start.data(), start.size());
    if (const auto size = read_image_size(start)) return *size;
  }
  Frame frame;
  read_image_file(path, frame, Orientation::kAsStored);
  return {frame.image.width_px, frame.image.height_px};
}

}  // namespace maq
