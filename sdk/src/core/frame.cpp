#include "core/frame.h"

#include <cstdint>
#include <cstring>

#include "core/checked_arithmetic.h"
#include "core/error.h"

namespace maq {
namespace {

// Decoders and encoders of files take an int.
constexpr size_t kMaxStrideBytes = INT32_MAX;

}  // namespace

uint8_t* Frame::allocate(maq_pixel_format format, int width_px, int height_px) {
  storage.resize(packed_bytes(format, width_px, height_px));
  image = packed_view(format, width_px, height_px, storage.data());
  return storage.data();
}

const char* pixel_format_name(maq_pixel_format format) {
  switch (format) {
    case MAQ_PIXEL_RGB8: return "RGB8";
    case MAQ_PIXEL_BGR8: return "BGR8";
    case MAQ_PIXEL_RGBA8: return "RGBA8";
    case MAQ_PIXEL_GREY8: return "GREY8";
    case MAQ_PIXEL_NV12: return "NV12";
    case MAQ_PIXEL_YUYV: return "YUYV";
    case MAQ_PIXEL_DEPTH16: return "DEPTH16";
    case MAQ_PIXEL_DEPTH32F: return "DEPTH32F";
  }
  return "unknown";
}

int plane_count(maq_pixel_format format) { return format == MAQ_PIXEL_NV12 ? 2 : 1; }

size_t row_bytes(maq_pixel_format format, int plane, int width_px) {
  const size_t width = size_t(width_px);
  switch (format) {
    case MAQ_PIXEL_RGB8:
    case MAQ_PIXEL_BGR8: return width * 3;
    case MAQ_PIXEL_RGBA8: return width * 4;
    case MAQ_PIXEL_GREY8: return width;
    case MAQ_PIXEL_NV12: return plane == 0 ? width : (width + 1) / 2 * 2;
    case MAQ_PIXEL_YUYV: return (width + 1) / 2 * 4;
    case MAQ_PIXEL_DEPTH16: return width * 2;
    case MAQ_PIXEL_DEPTH32F: return width * 4;
  }
  return 0;
}

int plane_rows(maq_pixel_format format, int plane, int height_px) {
  return format == MAQ_PIXEL_NV12 && plane == 1 ? (height_px + 1) / 2 : height_px;
}

std::optional<size_t> bytes_of_rows(size_t stride_bytes, int rows, size_t row_bytes) {
  const std::optional<size_t> before = checked_product(stride_bytes, size_t(rows - 1));
  const std::optional<size_t> all = before ? checked_sum(*before, row_bytes) : before;
  return all && *all <= size_t(PTRDIFF_MAX) ? all : std::nullopt;
}

size_t packed_bytes(maq_pixel_format format, int width_px, int height_px) {
  size_t bytes = 0;
  for (int plane = 0; plane < plane_count(format); ++plane) {
    bytes += row_bytes(format, plane, width_px) * size_t(plane_rows(format, plane, height_px));
  }
  return bytes;
}

ImageView packed_view(maq_pixel_format format, int width_px, int height_px, const uint8_t* pixels) {
  ImageView view{format, width_px, height_px, {}};
  for (int plane = 0; plane < plane_count(format); ++plane) {
    const size_t row = row_bytes(format, plane, width_px);
    view.planes[plane] = {pixels, row};
    pixels += row * size_t(plane_rows(format, plane, height_px));
  }
  return view;
}

void copy_packed(const ImageView& image, uint8_t* pixels) {
  for (int plane = 0; plane < plane_count(image.format); ++plane) {
    const size_t row = row_bytes(image.format, plane, image.width_px);
    const uint8_t* from = image.planes[plane].data;
    for (int y = 0; y < plane_rows(image.format, plane, image.height_px); ++y) {
      std::memcpy(pixels, from, row);
      pixels += row;
      from += image.planes[plane].stride_bytes;
    }
  }
}

ImageView window_of(const ImageView& image, int x, int y, int width_px, int height_px) {
  ImageView window{image.format, width_px, height_px, {}};
  for (int plane = 0; plane < plane_count(image.format); ++plane) {
    const PlaneView& from = image.planes[plane];
    const size_t rows = size_t(plane_rows(image.format, plane, y));
    window.planes[plane] = {from.data + rows * from.stride_bytes + row_bytes(image.format, plane, x),
                            from.stride_bytes};
  }
  return window;
}

void check_image_size(int64_t width_px, int64_t height_px, const std::string& what) {
  if (width_px < 1 || height_px < 1) {
    throw Error(MAQ_ERROR_IMAGE_SIZE, what, " is ", width_px, " x ", height_px,
                " pixels; an image needs at least one pixel each way.");
  }
  if (width_px > MAQ_MAX_SIDE_PX || height_px > MAQ_MAX_SIDE_PX || width_px * height_px > MAQ_MAX_PIXELS) {
    throw Error(MAQ_ERROR_IMAGE_SIZE, what, " is ", width_px, " x ", height_px, " pixels, over the limit of ",
                MAQ_MAX_SIDE_PX, " a side and ", MAQ_MAX_PIXELS / (1024 * 1024), " megapixels; scale it down first.");
  }
}

ImageView checked_image_view(const maq_frame_desc& desc) {
  if (desc.format < MAQ_PIXEL_RGB8 || desc.format > MAQ_PIXEL_DEPTH32F) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "Pixel format ", int(desc.format),
                " is not known; use one of maq_pixel_format.");
  }
  check_image_size(desc.width_px, desc.height_px, "The frame");
  ImageView view{desc.format, desc.width_px, desc.height_px, {}};
  for (int plane = 0; plane < plane_count(desc.format); ++plane) {
    const size_t shortest = row_bytes(desc.format, plane, desc.width_px);
    const size_t stride = desc.stride_bytes[plane] == 0 ? shortest : desc.stride_bytes[plane];
    if (desc.planes[plane] == nullptr) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "desc.planes[", plane, "] is NULL, but ", pixel_format_name(desc.format),
                  " has ", plane_count(desc.format), " plane(s).");
    }
    if (stride < shortest) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "desc.stride_bytes[", plane, "] is ", stride, ", but a row of ",
                  desc.width_px, " pixels in ", pixel_format_name(desc.format), " takes ", shortest, " bytes.");
    }
    const int rows = plane_rows(desc.format, plane, desc.height_px);
    const std::optional<size_t> bytes =
        stride <= kMaxStrideBytes ? bytes_of_rows(stride, rows, shortest) : std::nullopt;
    if (!bytes || !checked_sum(reinterpret_cast<uintptr_t>(desc.planes[plane]), uintptr_t(*bytes))) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "desc.stride_bytes[", plane, "] is ", stride, ", but ", rows,
                  " rows that far apart are no image in memory; a row of it takes ", shortest, " bytes.");
    }
    view.planes[plane] = PlaneView{desc.planes[plane], stride};
  }
  return view;
}

}  // namespace maq
