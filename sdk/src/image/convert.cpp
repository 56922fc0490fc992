#include "image/convert.h"

#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "image/opencv_view.h"

namespace maq {
namespace {

cv::Mat plane_as_mat(const ImageView& image, int plane, int rows, int cols, int type) {
  const PlaneView& view = image.planes[plane];
  return cv::Mat(rows, cols, type, const_cast<uint8_t*>(view.data), view.stride_bytes);
}

// A picture of three channels in memory that is kept.
cv::Mat picture_in(std::vector<uint8_t>& memory, int rows, int cols) {
  memory.resize(size_t(rows) * size_t(cols) * 3);
  return cv::Mat(rows, cols, CV_8UC3, memory.data());
}

// OpenCV wants even sizes for subsampled colour. The last row and column are repeated to get there and cut off after.
cv::Mat nv12_to_bgr(const ImageView& image, std::vector<uint8_t>& memory) {
  const int width = image.width_px;
  const int height = image.height_px;
  const int even_width = (width + 1) / 2 * 2;
  const int even_height = (height + 1) / 2 * 2;
  cv::Mat luma = plane_as_mat(image, 0, height, width, CV_8UC1);
  if (even_width != width || even_height != height) {
    cv::Mat padded;
    cv::copyMakeBorder(luma, padded, 0, even_height - height, 0, even_width - width, cv::BORDER_REPLICATE);
    luma = padded;
  }
  const cv::Mat chroma = plane_as_mat(image, 1, even_height / 2, even_width / 2, CV_8UC2);
  cv::Mat bgr = picture_in(memory, even_height, even_width);
  cv::cvtColorTwoPlane(luma, chroma, bgr, cv::COLOR_YUV2BGR_NV12);
  return bgr(cv::Rect(0, 0, width, height));
}

cv::Mat yuyv_to_bgr(const ImageView& image, std::vector<uint8_t>& memory) {
  const int even_width = (image.width_px + 1) / 2 * 2;
  const cv::Mat yuyv = plane_as_mat(image, 0, image.height_px, even_width, CV_8UC2);
  cv::Mat bgr = picture_in(memory, image.height_px, even_width);
  cv::cvtColor(yuyv, bgr, cv::COLOR_YUV2BGR_YUYV);
  return bgr(cv::Rect(0, 0, image.width_px, image.height_px));
}

cv::Mat converted(const ImageView& image, int type, int code, std::vector<uint8_t>& memory) {
  cv::Mat bgr = picture_in(memory, image.height_px, image.width_px);
  cv::cvtColor(plane_as_mat(image, 0, image.height_px, image.width_px, type), bgr, code);
  return bgr;
}

}  // namespace

cv::Mat as_bgr(const ImageView& image, std::vector<uint8_t>& memory) {
  switch (image.format) {
    case MAQ_PIXEL_BGR8: return plane_as_mat(image, 0, image.height_px, image.width_px, CV_8UC3);
    case MAQ_PIXEL_RGB8: return converted(image, CV_8UC3, cv::COLOR_RGB2BGR, memory);
    case MAQ_PIXEL_RGBA8: return converted(image, CV_8UC4, cv::COLOR_RGBA2BGR, memory);
    case MAQ_PIXEL_GREY8: return converted(image, CV_8UC1, cv::COLOR_GRAY2BGR, memory);
    case MAQ_PIXEL_NV12: return nv12_to_bgr(image, memory);
    case MAQ_PIXEL_YUYV: return yuyv_to_bgr(image, memory);
    case MAQ_PIXEL_DEPTH16: throw Error(MAQ_ERROR_UNSUPPORTED, "A depth image has no colours; give the picture.");
  }
  throw Error(MAQ_ERROR_UNSUPPORTED, "Pixel format ", int(image.format), " is not known.");
}

void copy_pixels(const ImageView& image, maq_pixel_format format, uint8_t* pixels, size_t stride_bytes,
                 size_t size_bytes) {
  if (format < MAQ_PIXEL_RGB8 || format > MAQ_PIXEL_GREY8) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "Pixels cannot be copied as ", pixel_format_name(format),
                "; ask for RGB8, BGR8, RGBA8 or GREY8.");
  }
  const size_t shortest = row_bytes(format, 0, image.width_px);
  const size_t stride = stride_bytes == 0 ? shortest : stride_bytes;
  if (stride < shortest) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "stride_bytes is ", stride, ", but a row of ", image.width_px,
                " pixels in ", pixel_format_name(format), " takes ", shortest, " bytes.");
  }
  // The padding after the last row need not be there.
  const size_t needed = stride * size_t(image.height_px - 1) + shortest;
  if (size_bytes < needed) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "size_bytes is ", size_bytes, ", but ", image.width_px, " x ",
                image.height_px, " pixels in ", pixel_format_name(format), " take ", needed, " bytes.");
  }
  std::vector<uint8_t> memory;
  const cv::Mat bgr = as_bgr(image, memory);
  const int channels = int(shortest / size_t(image.width_px));
  cv::Mat target(image.height_px, image.width_px, CV_8UC(channels), pixels, stride);
  switch (format) {
    case MAQ_PIXEL_RGB8: cv::cvtColor(bgr, target, cv::COLOR_BGR2RGB); break;
    case MAQ_PIXEL_RGBA8: cv::cvtColor(bgr, target, cv::COLOR_BGR2RGBA); break;
    case MAQ_PIXEL_GREY8: cv::cvtColor(bgr, target, cv::COLOR_BGR2GRAY); break;
    default: bgr.copyTo(target); break;
  }
}

void resize_to_bgr(const ImageView& from, int width_px, int height_px, Frame& to) {
  std::vector<uint8_t> memory;
  const cv::Mat bgr = as_bgr(from, memory);
  cv::Mat target(height_px, width_px, CV_8UC3, to.allocate_bgr(width_px, height_px));
  const bool shrinks = width_px <= from.width_px && height_px <= from.height_px;
  cv::resize(bgr, target, target.size(), 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
}

}  // namespace maq
