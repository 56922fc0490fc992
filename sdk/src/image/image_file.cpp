#include "image/image_file.h"

#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/file.h"
#include "image/file_decoders.h"
#include "image/image_header.h"

namespace maq {
void read_image_file(const std::string& path, Frame& frame) {
  const std::vector<uint8_t> bytes = read_file(path);
  if (bytes.empty()) throw Error(MAQ_ERROR_UNREADABLE, path, " is empty; an image file was expected.");
  if (bytes.size() > size_t(1) << 30) {
    throw Error(MAQ_ERROR_UNREADABLE, path, " is over 1 GiB; an image file was expected.");
  }
  if (const auto size = read_image_size(bytes)) check_image_size(size->width, size->height, path);

  const cv::Mat image = file_decoders().decode_image(bytes.data(), bytes.size());
  if (image.empty()) {
    throw Error(MAQ_ERROR_UNREADABLE, path,
                " cannot be decoded: it is damaged or no image; use a whole JPEG, PNG, WebP, BMP or TIFF file.");
  }
  check_image_size(image.cols, image.rows, path);
  uint8_t* pixels = frame.allocate_bgr(image.cols, image.rows);
  image.copyTo(cv::Mat(image.rows, image.cols, CV_8UC3, pixels));
}

}  // namespace maq
